//! The number of Zenoh's threads, which it takes from the environment alone. Only this file holds unsafe code.

use std::env;

/// The variable that Zenoh reads when it opens its first session.
const NAME: &str = "ZENOH_RUNTIME";
/// The threads that read connections. One of them waits for a client that asks and takes no answer, until it is cut off.
const READERS: &str = "(rx: (worker_threads: 16))";

/// Sets the number of threads, unless the environment has one. `main` calls this before anything else.
pub(crate) fn prepare() {
    if env::var_os(NAME).is_none() {
        // SAFETY: there is no other thread yet that could read the environment.
        unsafe { env::set_var(NAME, READERS) };
    }
}
