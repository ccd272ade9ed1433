//! Zenoh's threads and how its connections close, for which its configuration has no setting.
//! Only this file holds unsafe code.

use std::mem::ManuallyDrop;
use std::net::TcpStream;
use std::os::fd::{FromRawFd, RawFd};
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

/// The place of `tcpi_bytes_received` in the `tcp_info` of Linux, in words of 64 bits.
const BYTES_RECEIVED: usize = 16;

/// Sets the threads, unless the environment does. `main` calls this before anything else.
pub(crate) fn prepare() {
    if env::var_os(NAME).is_some() {
        crate::note(format_args!("{NAME} is set: the limits of connections do not hold"));
    } else {
        // SAFETY: there is no other thread yet that could read the environment.
        unsafe { env::set_var(NAME, THREADS) };
    }
}

/// Returns the numbers of the open files.
fn files() -> impl Iterator<Item = RawFd> {
    let files = fs::read_dir("/proc/self/fd").into_iter().flatten().flatten();
    files.filter_map(|file| file.file_name().to_str()?.parse().ok())
}

/// Returns TCP's sockets, which others may close meanwhile, each with how much has come from its other side.
pub(crate) fn sockets() -> impl Iterator<Item = (ManuallyDrop<TcpStream>, u64)> {
    files().filter_map(|number| {
        let mut info = [0_u64; BYTES_RECEIVED + 1];
        let mut length = size_of_val(&info) as libc::socklen_t;
        let (level, name, into) = (libc::IPPROTO_TCP, libc::TCP_INFO, info.as_mut_ptr().cast());
        // SAFETY: the system writes `length` bytes at most, and refuses any other file.
        let result = unsafe { libc::getsockopt(number, level, name, into, &raw mut length) };
        // SAFETY: it is never dropped, so it closes nothing; the system refuses a number that is of no file by now.
        let socket = || ManuallyDrop::new(unsafe { TcpStream::from_raw_fd(number) });
        (result == 0).then(|| (socket(), info[BYTES_RECEIVED]))
    })
}

/// Lets the system send what waits in open connections after they are closed: Zenoh's are reset otherwise.
pub(crate) fn release_connections() {
    let off = libc::linger { l_onoff: 0, l_linger: 0 };
    for file in files() {
        let length = size_of_val(&off) as libc::socklen_t;
        // SAFETY: the system only reads `off`, and refuses a file that is closed by now or is no socket.
        unsafe { libc::setsockopt(file, libc::SOL_SOCKET, libc::SO_LINGER, (&raw const off).cast(), length) };
    }
}
