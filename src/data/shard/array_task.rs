//! One of several tasks that write a data set together, as those of a cluster's job array.

use std::fmt;

use super::names;

/// Largest number of tasks.
pub const MAX_TASKS: u32 = 100_000;

/// One of several tasks that write a data set together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ArrayTask {
    index: u32,
    count: u32,
}

impl ArrayTask {
    /// Task `index` (from 0) of `count`; `None` if there is none, or if there are more than
    /// [`MAX_TASKS`].
    #[must_use]
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (index < count && count <= MAX_TASKS).then_some(Self { index, count })
    }

    /// Which one it is, from 0.
    pub(super) fn index(self) -> u32 {
        self.index
    }

    /// How many tasks there are.
    #[must_use]
    pub fn count(self) -> u32 {
        self.count
    }

    /// Whether the recording at this position of the list of all is this task's.
    #[must_use]
    pub fn takes(self, position: usize) -> bool {
        position % self.count as usize == self.index as usize
    }

    /// The file of its piece, relative to the data set.
    #[must_use]
    pub fn file(self) -> String {
        file_of(self.index, self.count)
    }
}

impl fmt::Display for ArrayTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-of-{}", self.index, self.count)
    }
}

/// The file of the piece of a task.
pub(super) fn file_of(index: u32, count: u32) -> String {
    format!("{}/{index}-of-{count}.json", names::TASKS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_recording_is_one_tasks() {
        for count in [1, 3, 7] {
            for position in 0..20 {
                let takers = (0..count).filter_map(|index| ArrayTask::new(index, count));
                assert_eq!(takers.filter(|task| task.takes(position)).count(), 1);
            }
        }
        assert!(ArrayTask::new(3, 3).is_none() && ArrayTask::new(0, 0).is_none());
    }
}
