//! Timer 1, which runs freely at 2 MHz: the clock in microseconds, and the step interrupt.
//!
//! A step's time is a compare value computed from the last one, never from when an interrupt got
//! its turn, so that lateness does not add up.

use crate::common::STEPPER;
use crate::masked::{Masked, Shared};
use crate::pins;
use crate::registers::{CS11, OCIE1A, OCR1A, TCCR1B, TCNT1, TIFR1, TIMSK1, TOIE1, TOV1};

/// How often the timer went round, every 32.768 ms.
static ROUNDS: Shared<u32> = Shared::new(0);

static STEP_TIMER: Shared<StepTimer> = Shared::new(StepTimer {
    running: false,
    ahead: 0,
});

/// Half microseconds from "now" to the soonest compare that is not missed.
const SOON: u16 = 16;

/// The way to the next step.
struct StepTimer {
    /// Off: compares mean nothing.
    running: bool,
    /// Half microseconds to wait beyond the compare that is set.
    ahead: u32,
}

impl StepTimer {
    /// Sets the next compare: at the end of the wait, or nearer where that is out of sight.
    fn advance(&mut self) {
        let slice = match u16::try_from(self.ahead) {
            Ok(ahead) if ahead < 0x8000 => ahead,
            _ => 0x4000,
        };
        self.ahead -= u32::from(slice);
        let due = OCR1A.read().wrapping_add(slice);
        OCR1A.write(due);
        let now = TCNT1.read();
        if due.wrapping_sub(now).wrapping_sub(SOON) >= 0x8000 {
            OCR1A.write(now.wrapping_add(SOON));
        }
    }
}

/// Lets the timer run.
pub(crate) fn start() {
    TCCR1B.write(CS11);
    TIMSK1.write(TOIE1 | OCIE1A);
}

/// Stops step pulses for good, for a program that has failed.
pub(crate) fn stop_for_good() {
    TIMSK1.write(0);
}

/// Microseconds since the start; wraps after 71 minutes.
pub(crate) fn micros(masked: &mut Masked) -> u32 {
    let mut rounds = *ROUNDS.lend(masked);
    let ticks = TCNT1.read();
    // The timer went round, and its interrupt still waits behind the mask.
    if TIFR1.has(TOV1) && ticks < 0x8000 {
        rounds = rounds.wrapping_add(1);
    }
    (rounds << 15) | u32::from(ticks >> 1)
}

/// Makes the step interrupt come soon if it rests.
pub(crate) fn start_steps(masked: &mut Masked) {
    let timer = STEP_TIMER.lend(masked);
    if !timer.running {
        timer.running = true;
        timer.ahead = 0;
        OCR1A.write(TCNT1.read().wrapping_add(SOON));
    }
}

/// Compare match of timer 1: the time of a step, or a stage on the way to it.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_11() {
    // SAFETY: the one proof of this handler, and interrupts never nest.
    let mut masked = unsafe { Masked::in_interrupt() };
    let timer = STEP_TIMER.lend(&mut masked);
    if !timer.running {
        return;
    }
    if timer.ahead > 0 {
        timer.advance();
        return;
    }
    step(&mut masked);
}

fn step(masked: &mut Masked) {
    let outputs = pins::outputs(masked);
    let fire = STEPPER.lend(masked).fire(pins::index());
    let begin = TCNT1.read();
    if fire.pulse {
        pins::set_step(true, outputs);
    }
    let timer = STEP_TIMER.lend(masked);
    match fire.next {
        Some(ticks) => {
            timer.ahead = ticks;
            timer.advance();
        }
        None => timer.running = false,
    }
    if fire.pulse {
        while TCNT1.read().wrapping_sub(begin) < u16::from(outputs.pulse_us) * 2 {}
        pins::set_step(false, outputs);
    }
    pins::set_direction(fire.forward, outputs);
}

/// Overflow of timer 1.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_13() {
    // SAFETY: the one proof of this handler, and interrupts never nest.
    let mut masked = unsafe { Masked::in_interrupt() };
    let rounds = ROUNDS.lend(&mut masked);
    *rounds = rounds.wrapping_add(1);
}
