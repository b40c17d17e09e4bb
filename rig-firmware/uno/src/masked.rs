//! Data that the main loop shares with interrupts.
//!
//! Whoever holds a [`Masked`] runs with interrupts off: an interrupt's handler from its start, the
//! main loop inside of [`Foreground::masked`]. There is one [`Foreground`], and it is borrowed
//! meanwhile, so two of them never overlap; and a [`Shared`] lends its content for as long as a
//! `Masked` is borrowed, so nobody sees the same data twice.

use core::arch::asm;
use core::cell::UnsafeCell;

/// Proof that interrupts are off.
pub(crate) struct Masked(());

impl Masked {
    /// For the handler of an interrupt.
    ///
    /// # Safety
    ///
    /// Interrupts are off, stay off while the value lives, and the handler makes one only.
    pub(crate) unsafe fn in_interrupt() -> Masked {
        Masked(())
    }
}

/// The main loop: whatever runs outside of interrupts.
pub(crate) struct Foreground(());

impl Foreground {
    /// The one main loop.
    ///
    /// # Safety
    ///
    /// To be made once, and never in an interrupt.
    pub(crate) unsafe fn new() -> Foreground {
        Foreground(())
    }

    /// Runs `f` with interrupts off, and leaves them as they were.
    pub(crate) fn masked<R>(&mut self, f: impl FnOnce(&mut Masked) -> R) -> R {
        let status: u8;
        // SAFETY: reads the status register and turns interrupts off; no memory is touched, and
        // the compiler moves no access to memory across it.
        unsafe { asm!("in {}, 0x3f", "cli", out(reg) status) };
        let result = f(&mut Masked(()));
        // SAFETY: restores the status register that was read above.
        unsafe { asm!("out 0x3f, {}", in(reg) status) };
        result
    }

    /// Lets interrupts come from here on.
    pub(crate) fn enable_interrupts(&mut self) {
        // SAFETY: no `Masked` is alive: one from `masked` would borrow `self`.
        unsafe { asm!("sei") };
    }
}

/// Something that interrupts and the main loop use in turn.
pub(crate) struct Shared<T>(UnsafeCell<T>);

// SAFETY: `lend` demands that interrupts are off, and the chip has one core.
unsafe impl<T: Send> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// Holds `content`.
    pub(crate) const fn new(content: T) -> Shared<T> {
        Shared(UnsafeCell::new(content))
    }

    /// The content, for as long as the proof is borrowed.
    pub(crate) fn lend<'a>(&'a self, _: &'a mut Masked) -> &'a mut T {
        // SAFETY: the proof is unique while interrupts are off, and borrowed as long as the
        // reference lives, so there is no other reference to the content.
        unsafe { &mut *self.0.get() }
    }
}
