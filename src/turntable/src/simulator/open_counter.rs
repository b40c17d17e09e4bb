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

    pub(in crate::simulator) struct OpenCounter(OwnedFd);

    impl OpenCounter {
        pub(in crate::simulator) fn watch(port: &Path) -> Result<Self, Errno> {
            let flags = inotify::CreateFlags::NONBLOCK | inotify::CreateFlags::CLOEXEC;
            let watch = inotify::init(flags)?;
            inotify::add_watch(&watch, port, inotify::WatchFlags::OPEN)?;
            Ok(Self(watch))
        }

        /// Openings since the last call.
        pub(in crate::simulator) fn count(&mut self, _closed: bool) -> u64 {
            let mut buffer = [MaybeUninit::uninit(); 1024];
            let mut reader = inotify::Reader::new(&self.0, &mut buffer);
            let mut times = 0;
            while reader.next().is_ok() {
                times += 1;
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
