//! One process owns a port; others ask it.
//!
//! Opening an Arduino's port resets it, and so loses the table's position: a second program must
//! not do that to look at the table or to stop it. The owner holds a lock for as long as it has
//! the port, and answers at a socket next to it. Both are named by the port's device number, so
//! that every name of the port leads to them. The kernel drops the lock of a process that is
//! killed, and so a socket without a lock is a dead one's.

mod claim;
mod client;
mod server;
#[cfg(test)]
mod tests;

pub(super) use claim::Claim;
pub use client::Owner;
pub(super) use server::Server;

use super::status::TableStatus;

/// What can be asked of an owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Question {
    Status,
    Stop,
}

/// What it answers.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Answer {
    Status(TableStatus),
    Error(String),
}
