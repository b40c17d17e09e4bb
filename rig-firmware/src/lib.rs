//! The core of the turntable's firmware.
#![no_std]
