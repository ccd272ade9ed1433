//! Zenoh's threads and how its connections close, for which its configuration has no setting.
//! Only this file holds unsafe code.

use std::{env, fs};

// Zenoh reads it when it is built.
const _: () = assert!(
    matches!(option_env!("TCP_LINGER_TIMEOUT"), Some(seconds) if matches!(seconds.as_bytes(), b"0")),
    "TCP_LINGER_TIMEOUT is not 0: build wstac-node in its repository, whose .cargo/config.toml sets it"
);

/// The variable that Zenoh reads when it opens its first session.
const NAME: &str = "ZENOH_RUNTIME";
/// The numbers of Zenoh's threads.
///
/// `rx` reads connections. A client that asks and does not read the answer holds a thread of it until it is cut off.
/// `acc` accepts connections in the single thread of `net`, which also closes those above the limit.
/// With two threads, more connections could be open than the process may have files.
const THREADS: &str = "(rx: (worker_threads: 16), acc: (handover: net))";

/// Sets the threads, unless the environment does. `main` calls this before anything else.
pub(crate) fn prepare() {
    if env::var_os(NAME).is_some() {
        crate::note(format_args!("{NAME} is set: the limits of connections do not hold"));
    } else {
        // SAFETY: there is no other thread yet that could read the environment.
        unsafe { env::set_var(NAME, THREADS) };
    }
}

/// Lets the system send what waits in open connections after they are closed: Zenoh's are reset otherwise.
pub(crate) fn release_connections() {
    let off = libc::linger { l_onoff: 0, l_linger: 0 };
    let files = fs::read_dir("/proc/self/fd").into_iter().flatten().flatten();
    for file in files.filter_map(|file| file.file_name().to_str()?.parse().ok()) {
        let length = size_of_val(&off) as libc::socklen_t;
        // SAFETY: the system only reads `off`, and refuses a file that is closed by now or is no socket.
        unsafe { libc::setsockopt(file, libc::SOL_SOCKET, libc::SO_LINGER, (&raw const off).cast(), length) };
    }
}
