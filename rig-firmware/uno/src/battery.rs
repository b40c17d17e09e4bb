//! The battery's divided voltage at A5, measured without end against the supply of 5 V.

use crate::masked::Masked;
use crate::registers::{ADATE, ADC, ADCSRA, ADEN, ADMUX, ADPS_128, ADSC, DIDR0, REFS_AVCC, bit};

const CHANNEL: u8 = 5;

/// Starts converting, once every 104 us.
pub(crate) fn start() {
    DIDR0.write(bit(CHANNEL));
    ADMUX.write(REFS_AVCC | CHANNEL);
    ADCSRA.write(ADEN | ADSC | ADATE | ADPS_128);
}

/// The last conversion, 0..=1023.
pub(crate) fn read(_: &mut Masked) -> u16 {
    ADC.read()
}
