//! Counting how often the simulated serial port is opened: an Arduino's chip restarts each time.

#[cfg(target_os = "linux")]
pub(super) use self::notified::OpenCounter;
#[cfg(not(target_os = "linux"))]
pub(super) use self::polled::OpenCounter;

/// By inotify, which reports every opening.
#[cfg(target_os = "linux")]
mod notified {
    use std::mem::MaybeUninit;
    use std::os::fd::OwnedFd;
    use std::path::Path;

    use rustix::fs::inotify;
    use rustix::io::Errno;

    pub(in crate::simulator) struct OpenCounter {
        watch: OwnedFd,
        /// How many have the port open: whoever comes second resets nothing.
        open: usize,
    }

    impl OpenCounter {
        pub(in crate::simulator) fn watch(port: &Path) -> Result<Self, Errno> {
            let flags = inotify::CreateFlags::NONBLOCK | inotify::CreateFlags::CLOEXEC;
            let watch = inotify::init(flags)?;
            let flags = inotify::WatchFlags::OPEN | inotify::WatchFlags::CLOSE;
            inotify::add_watch(&watch, port, flags)?;
            Ok(Self { watch, open: 0 })
        }

        /// Openings of a closed port since the last call. `closed`: whether it was closed then.
        pub(in crate::simulator) fn count(&mut self, closed: bool) -> u64 {
            if closed {
                self.open = 0;
            }
            let mut buffer = [MaybeUninit::uninit(); 1024];
            let mut reader = inotify::Reader::new(&self.watch, &mut buffer);
            let mut times = 0;
            while let Ok(event) = reader.next() {
                if event.events().contains(inotify::ReadFlags::OPEN) {
                    times += u64::from(self.open == 0);
                    self.open += 1;
                } else {
                    self.open = self.open.saturating_sub(1);
                }
            }
            times
        }
    }
}

/// By looking whether the port is open: one that is closed and opened between two calls is missed.
#[cfg(not(target_os = "linux"))]
mod polled {
    use std::path::Path;

    use rustix::io::Errno;

    pub(in crate::simulator) struct OpenCounter {
        closed: bool,
    }

    impl OpenCounter {
        pub(in crate::simulator) fn watch(_port: &Path) -> Result<Self, Errno> {
            Ok(Self { closed: true })
        }

        /// Openings since the last call. `closed`: whether the port is closed now.
        pub(in crate::simulator) fn count(&mut self, closed: bool) -> u64 {
            let was_closed = std::mem::replace(&mut self.closed, closed);
            u64::from(was_closed && !closed)
        }
    }
}
