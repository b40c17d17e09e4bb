//! What the interrupts of several parts of the chip and the main loop work on together.

use rig_firmware::board::Events;
use rig_firmware::stepper::Stepper;

use crate::masked::Shared;

/// The step generator.
pub(crate) static STEPPER: Shared<Stepper> = Shared::new(Stepper::new());

/// What interrupts noted for the main loop.
pub(crate) static EVENTS: Shared<Events> = Shared::new(Events::NONE);
