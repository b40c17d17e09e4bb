//! The processes of a run, and sums over them: c10d's TCPStore and Gloo, through native/c10d.cpp. The only place that
//! knows of either.
//!
//! Tensors travel through the main memory, those of a GPU too.
#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int};
use std::ptr::{self, NonNull};
use std::time::Duration;

use tch::{Device, Kind, Tensor, no_grad};
use torch_sys::C_tensor;

use super::launch::Launch;
use crate::error::TrainError;
use relight_core::reader::Rank;

/// How long a process waits for the others to be started.
const JOIN: Duration = Duration::from_secs(300);
/// How long it waits for one that is still connected and does not come to the next sum, as that of a machine that has
/// stopped. One that has ended is noticed at once. Process 0 validates and saves in this time.
const PATIENCE: Duration = Duration::from_secs(600);
/// Bytes for a reason.
const REASON: usize = 2048;

#[repr(C)]
struct RawGroup {
    _private: [u8; 0],
}

unsafe extern "C" {
    fn relight_group_join(
        host: *const c_char,
        port: u16,
        hosted: c_int,
        prefix: *const c_char,
        rank: c_int,
        size: c_int,
        join_ms: i64,
        patience_ms: i64,
        group: *mut *mut RawGroup,
        fault: *mut c_char,
        room: usize,
    ) -> c_int;
    fn relight_group_sum(
        group: *mut RawGroup,
        tensor: *mut C_tensor,
        fault: *mut c_char,
        room: usize,
    ) -> c_int;
    fn relight_group_leave(group: *mut RawGroup);
}

/// The processes of a run. All of them make the same calls in the same order.
#[derive(Debug)]
pub struct ProcessGroup {
    rank: Rank,
    raw: NonNull<RawGroup>,
}

impl ProcessGroup {
    /// Waits for the other processes; all have joined when it returns.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub fn join(launch: &Launch) -> Result<Self, TrainError> {
        let not_joined = |fault: String| {
            let (process, of) = (launch.rank.index(), launch.rank.world_size());
            let place = format!("{}:{}", launch.address, launch.port);
            TrainError::Refused(format!(
                "process {process} of {of} did not meet the others at {place} (MASTER_ADDR, MASTER_PORT): {fault}"
            ))
        };
        let host = CString::new(launch.address.as_str());
        let host = host.map_err(|fault| not_joined(fault.to_string()))?;
        let prefix = CString::new(format!("relight/{}", launch.attempt));
        let prefix = prefix.map_err(|fault| not_joined(fault.to_string()))?;
        let mut raw = ptr::null_mut();
        called(|fault| {
            // SAFETY: both texts end with a 0 and outlive the call, which writes one pointer to `raw` and at most
            // `REASON` bytes to `fault`.
            unsafe {
                relight_group_join(
                    host.as_ptr(),
                    launch.port,
                    c_int::from(launch.hosted),
                    prefix.as_ptr(),
                    launch.rank.index() as c_int,
                    launch.rank.world_size() as c_int,
                    JOIN.as_millis() as i64,
                    PATIENCE.as_millis() as i64,
                    &raw mut raw,
                    fault,
                    REASON,
                )
            }
        })
        .map_err(not_joined)?;
        let raw = NonNull::new(raw)
            .ok_or_else(|| not_joined("c10d did not create a group".to_owned()))?;
        let rank = launch.rank;
        Ok(Self { rank, raw })
    }

    /// Which process this is, and how many there are.
    pub fn rank(&self) -> Rank {
        self.rank
    }

    /// Whether this is process 0, which writes the run's files.
    pub fn is_first(&self) -> bool {
        self.rank.index() == 0
    }

    /// Replaces numbers by their sums over all processes; each has equally many.
    ///
    /// # Errors
    /// [`TrainError::ProcessLost`].
    pub fn sum(&self, values: &mut [f64]) -> Result<(), TrainError> {
        let mut tensor = Tensor::f_from_slice(values)?;
        self.sum_tensor(&mut tensor)?;
        let count = values.len();
        Ok(tensor.f_copy_data(values, count)?)
    }

    /// Replaces the gradients of parameters by their sums over all processes, which have the same parameters.
    ///
    /// # Errors
    /// [`TrainError::ProcessLost`].
    pub fn sum_gradients(&self, parameters: &BTreeMap<String, Tensor>) -> Result<(), TrainError> {
        no_grad(|| {
            // One operation for all of them: each costs a round through the network.
            let flat = parameters
                .values()
                .map(|parameter| {
                    let gradient = parameter.f_grad()?;
                    let is_there = gradient.defined();
                    let gradient = if is_there {
                        gradient
                    } else {
                        parameter.f_zeros_like()?
                    };
                    gradient.f_reshape([-1])
                })
                .collect::<Result<Vec<_>, _>>()?;
            let mut all = Tensor::f_cat(&flat, 0)?.f_to_device(Device::Cpu)?;
            self.sum_tensor(&mut all)?;
            let mut from = 0;
            for parameter in parameters.values() {
                let count = parameter.numel() as i64;
                let mut gradient = parameter.f_grad()?;
                if gradient.defined() {
                    let sum = all.f_narrow(0, from, count)?.f_reshape(parameter.size())?;
                    gradient.f_copy_(&sum)?;
                }
                from += count;
            }
            Ok(())
        })
    }

    /// `tensor` is dense and in the main memory.
    fn sum_tensor(&self, tensor: &mut Tensor) -> Result<(), TrainError> {
        debug_assert!(tensor.device() == Device::Cpu && tensor.kind() != Kind::Bool);
        let raw = tensor.as_mut_ptr();
        called(|fault| {
            // SAFETY: the group is one that `join` made and nothing has freed; `raw` is a tensor that outlives the
            // call, and nothing else uses it meanwhile; at most `REASON` bytes are written to `fault`.
            unsafe { relight_group_sum(self.raw.as_ptr(), raw, fault, REASON) }
        })
        .map_err(TrainError::ProcessLost)
    }

    /// Waits until the others are done as well, and closes the connections. A group that is dropped without it keeps
    /// them until the program ends: where another process is lost, operations may still be under way.
    pub fn leave(self) {
        // So that nothing that another process still reads is cut off. All is done: a fault changes nothing any more.
        if self.sum(&mut [0.0]).is_ok() {
            // SAFETY: the group is one that `join` made; `self` is gone after this.
            unsafe { relight_group_leave(self.raw.as_ptr()) }
        }
    }
}

/// A setting cannot be divided among the processes.
pub(crate) fn indivisible(name: &str, value: u64, rank: Rank, needed: &str) -> TrainError {
    let of = rank.world_size();
    TrainError::Refused(format!("{name} is {value}: {of} processes need {needed}"))
}

/// Makes a call that answers 0, or writes a reason.
fn called(call: impl FnOnce(*mut c_char) -> c_int) -> Result<(), String> {
    let mut reason = [0_u8; REASON];
    if call(reason.as_mut_ptr().cast()) == 0 {
        return Ok(());
    }
    let reason = CStr::from_bytes_until_nul(&reason).map(CStr::to_string_lossy);
    let reason = reason.unwrap_or_default();
    // Further lines are for those who build libtorch.
    Err(reason.lines().next().unwrap_or_default().trim().to_owned())
}
