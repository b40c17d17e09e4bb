//! One process owns a port; other processes send it requests.
//!
//! Opening an Arduino's port resets it and loses the table's position: a second program must not do
//! that to read the table's status or to stop it. The owner holds a lock as long as it has the port,
//! and answers at a socket next to it. Both are named by the port's device number, so that every name
//! of the port leads to them. The kernel releases the lock of a killed process: a socket without a
//! lock is left over from one.

mod claim;
mod client;
mod server;
#[cfg(test)]
mod tests;

pub(super) use claim::Claim;
pub use client::Owner;
pub(super) use server::Server;

use super::status::TableStatus;

/// A request to an owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Question {
    Status,
    Stop,
}

/// Its answer.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Answer {
    Status(TableStatus),
    Error(String),
}
