//! The chip has 2048 bytes of memory for everything.

use rig_firmware::controller::Controller;
use rig_firmware::stepper::Stepper;

#[test]
fn controller_and_stepper_leave_the_chip_room_for_its_buffers_and_stack() {
    // Here with a PC's alignment, which takes more than the chip's.
    let bytes = size_of::<Controller>() + size_of::<Stepper>();
    assert!(bytes < 700, "{bytes}");
}
