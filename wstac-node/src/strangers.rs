//! Connections that have not finished the handshake of Zenoh, which itself refuses new ones while old ones wait.

use std::collections::{HashMap, HashSet};
use std::net::{Shutdown, SocketAddr};
use std::os::fd::RawFd;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use wstac_host::error::{Error, ErrorKind};
use zenoh::sample::SampleKind;
use zenoh::session::LinkEvent;
use zenoh::{Session, Wait};
use zenoh_runtime::ZRuntime;

use crate::records::locked;
use crate::refused::refused;
use crate::threads;

/// The most that may wait. Zenoh has places for more, which are filled between two looks at most.
const MOST: usize = 128;
/// The time between two looks, while few wait and while many do.
const IDLE: Duration = Duration::from_millis(50);
const BUSY: Duration = Duration::from_millis(5);

/// Whoever has said less is silent: the length of a message has two bytes, and the end of a connection counts as one.
const LEAST_SAID: u64 = 2;

/// Ends the oldest connections of those that wait if there are too many, until the session ends.
///
/// # Errors
/// The session has ended.
pub(crate) fn watch(session: &Session) -> Result<(), Error> {
    let open = Arc::new(Mutex::new(HashSet::new()));
    let told = Arc::clone(&open);
    let tell = move |event: LinkEvent| {
        let peer = event.link().dst().address().as_str().to_owned();
        let mut open = locked(&told);
        let _ = if event.kind() == SampleKind::Put { open.insert(peer) } else { open.remove(&peer) };
    };
    let events = session.info().link_events_listener().callback(tell).background().wait();
    events.map_err(|error| refused(ErrorKind::Usage, "the network", &error))?;
    // The thread that accepts connections also counts them: however busy the machine is, few come between.
    ZRuntime::Net.spawn(async move {
        let mut oldest_first = Vec::new();
        // The session has dropped the other one when it ends.
        while Arc::strong_count(&open) > 1 {
            let count = end_some(&mut oldest_first, &open);
            tokio::time::sleep(if count < MOST / 4 { IDLE } else { BUSY }).await;
        }
    });
    Ok(())
}

/// Ends connections, and returns how many wait.
fn end_some(oldest_first: &mut Vec<SocketAddr>, open: &Mutex<HashSet<String>>) -> usize {
    let strangers = strangers(open);
    oldest_first.retain(|peer| strangers.contains_key(peer));
    let known: HashSet<_> = oldest_first.iter().copied().collect();
    oldest_first.extend(strangers.keys().filter(|peer| !known.contains(peer)));
    for peer in too_many(oldest_first, |peer| strangers[peer].1 > LEAST_SAID) {
        // The number may be of another connection by now. Zenoh closes this one when it reads its end.
        let socket = threads::socket(strangers[&peer].0).filter(|socket| socket.peer_addr().ok() == Some(peer));
        let _ = socket.map(|socket| socket.shutdown(Shutdown::Both));
    }
    strangers.len()
}

/// Returns those to end: of the addresses that have most, those that are silent, or else the oldest.
fn too_many(oldest_first: &[SocketAddr], has_spoken: impl Fn(&SocketAddr) -> bool) -> Vec<SocketAddr> {
    let mut best_first: Vec<_> = oldest_first.iter().rev().copied().collect();
    best_first.sort_by_key(|peer| !has_spoken(peer));
    let mut counts = HashMap::new();
    // The second of an address comes behind the first of all addresses.
    best_first.sort_by_cached_key(|peer| *counts.entry(peer.ip()).and_modify(|count| *count += 1).or_insert(0));
    best_first.split_off(MOST.min(best_first.len()))
}

/// Returns the connections to where the session listens that are not open yet, by their addresses: their files, and how much
/// has come from each.
fn strangers(open: &Mutex<HashSet<String>>) -> HashMap<SocketAddr, (RawFd, u64)> {
    let (mut listening, mut found) = (HashSet::new(), Vec::new());
    for (file, received) in threads::sockets() {
        let Some(socket) = threads::socket(file) else { continue };
        match (socket.local_addr(), socket.peer_addr()) {
            (Ok(here), Ok(peer)) => found.push((here.port(), (peer, (file, received)))),
            (Ok(here), Err(_)) => drop(listening.insert(here.port())),
            _ => {}
        }
    }
    let open = locked(open);
    found.retain(|(port, (peer, _))| listening.contains(port) && !open.contains(&peer.to_string()));
    found.into_iter().map(|(_, stranger)| stranger).collect()
}
