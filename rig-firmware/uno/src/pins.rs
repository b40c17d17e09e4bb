//! The pins, as the common CNC shield wires its X axis.
//!
//! | pin | chip | what |
//! | --- | --- | --- |
//! | D2 | PD2 | STEP |
//! | D5 | PD5 | DIR |
//! | D8 | PB0 | ENABLE, low feeds the driver |
//! | D9 | PB1 | X limit: the index sensor, with pull-up |
//! | A0 | PC0 | abort: the emergency stop, with pull-up |

use rig_firmware::board::{Events, Inputs, Outputs};

use crate::common::{EVENTS, STEPPER};
use crate::masked::{Masked, Shared};
use crate::registers::{
    DDRB, DDRD, PCICR, PCIE1, PCINT8, PCMSK1, PINB, PINC, PORTB, PORTC, PORTD, bit,
};

const STEP: u8 = bit(2);
const DIRECTION: u8 = bit(5);
const ENABLE: u8 = bit(0);
const INDEX: u8 = bit(1);
const EMERGENCY_STOP: u8 = bit(0);

/// How the output pins are wired, and whether the driver is fed; zero until the settings are read.
static DRIVER: Shared<Driver> = Shared::new(Driver {
    outputs: Outputs {
        pulse_us: 0,
        invert_step: false,
        invert_direction: false,
        invert_enable: false,
    },
    fed: false,
});

struct Driver {
    outputs: Outputs,
    fed: bool,
}

impl Driver {
    fn apply(&self) {
        PORTB.change(ENABLE, self.fed == self.outputs.invert_enable);
    }
}

/// Sets all pins up, the driver released.
pub(crate) fn start() {
    // Levels before directions: no pin shows a wrong level in between.
    PORTB.write(ENABLE | INDEX);
    DDRB.write(ENABLE);
    PORTC.write(EMERGENCY_STOP);
    PORTD.write(0);
    DDRD.write(STEP | DIRECTION);
    PCMSK1.write(PCINT8);
    PCICR.write(PCIE1);
}

/// Takes over how the outputs are wired.
pub(crate) fn configure(outputs: Outputs, masked: &mut Masked) {
    let driver = DRIVER.lend(masked);
    driver.outputs = outputs;
    driver.apply();
    PORTD.change(STEP, outputs.invert_step);
}

/// How the outputs are wired.
pub(crate) fn outputs(masked: &mut Masked) -> Outputs {
    DRIVER.lend(masked).outputs
}

/// Feeds the motor driver, or releases it.
pub(crate) fn feed_driver(fed: bool, masked: &mut Masked) {
    let driver = DRIVER.lend(masked);
    driver.fed = fed;
    driver.apply();
}

/// Starts or ends a step pulse.
pub(crate) fn set_step(active: bool, outputs: Outputs) {
    PORTD.change(STEP, active != outputs.invert_step);
}

/// Sets the direction of the next pulse: low for a positive turn, as Grbl has it.
pub(crate) fn set_direction(forward: bool, outputs: Outputs) {
    PORTD.change(DIRECTION, forward == outputs.invert_direction);
}

/// Whether the index input is closed.
pub(crate) fn index() -> bool {
    !PINB.has(INDEX)
}

/// Both inputs.
pub(crate) fn inputs() -> Inputs {
    Inputs {
        index: index(),
        emergency_stop: emergency_stop(),
    }
}

fn emergency_stop() -> bool {
    !PINC.has(EMERGENCY_STOP)
}

/// Pin change of A0: the emergency stop. Steps end and the driver is released here; the main
/// loop may be busy.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_4() {
    // SAFETY: the one proof of this handler, and interrupts never nest.
    let mut masked = unsafe { Masked::in_interrupt() };
    if STEPPER.lend(&mut masked).emergency(emergency_stop()) {
        feed_driver(false, &mut masked);
        EVENTS.lend(&mut masked).insert(Events::EMERGENCY);
    }
}
