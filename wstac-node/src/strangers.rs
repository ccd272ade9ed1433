//! Connections that have not finished the handshake of Zenoh, which itself refuses new ones while old ones wait.

use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::mem::ManuallyDrop;
use std::net::{Shutdown, SocketAddr, TcpStream};
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
    let open = links(session)?;
    // The thread that accepts connections also counts them: however busy the machine is, few come between.
    ZRuntime::Net.spawn(async move {
        // Nobody else can have this file when all are open that the process may open.
        let spare = || File::open("/dev/null").ok();
        let (mut oldest_first, mut kept) = (Vec::new(), spare());
        // The session has dropped the other one when it ends.
        while Arc::strong_count(&open) > 1 {
            // Without a further file, nobody else can be accepted, nor any service open one.
            let most = if spare().is_some() { MOST } else { oldest_first.len() / 2 };
            // A look opens one file at a time, and nobody is accepted meanwhile.
            drop(kept);
            let count = end_some(&mut oldest_first, &open, most);
            kept = spare();
            tokio::time::sleep(if count < MOST / 4 { IDLE } else { BUSY }).await;
        }
    });
    Ok(())
}

/// Returns the addresses of connections after their handshake, now and later.
fn links(session: &Session) -> Result<Arc<Mutex<HashSet<String>>>, Error> {
    let open = Arc::new(Mutex::new(HashSet::new()));
    let told = Arc::clone(&open);
    let tell = move |event: LinkEvent| {
        let peer = event.link().dst().address().as_str().to_owned();
        let mut open = locked(&told);
        let _ = if event.kind() == SampleKind::Put { open.insert(peer) } else { open.remove(&peer) };
    };
    // The session may have accepted some before.
    let events = session.info().link_events_listener().history(true).callback(tell).background().wait();
    events.map(|()| open).map_err(|error| refused(ErrorKind::Usage, "the network", &error))
}

/// Ends connections, and returns how many wait.
fn end_some(oldest_first: &mut Vec<SocketAddr>, open: &Mutex<HashSet<String>>, most: usize) -> usize {
    let strangers = strangers(open);
    oldest_first.retain(|peer| strangers.contains_key(peer));
    let known: HashSet<_> = oldest_first.iter().copied().collect();
    oldest_first.extend(strangers.keys().filter(|peer| !known.contains(peer)));
    for peer in too_many(oldest_first, most, |peer| strangers[peer].1 > LEAST_SAID) {
        // It may be another connection by now, but not its copy. Zenoh closes this one when it reads its end.
        let socket = strangers[&peer].0.try_clone().ok().filter(|socket| socket.peer_addr().ok() == Some(peer));
        let _ = socket.map(|socket| socket.shutdown(Shutdown::Both));
    }
    strangers.len()
}

/// Returns those to end: of the addresses that have most, those that are silent, or else the oldest.
fn too_many(oldest_first: &[SocketAddr], most: usize, has_spoken: impl Fn(&SocketAddr) -> bool) -> Vec<SocketAddr> {
    let mut best_first: Vec<_> = oldest_first.iter().rev().copied().collect();
    best_first.sort_by_key(|peer| !has_spoken(peer));
    let mut counts = HashMap::<_, usize>::new();
    let place = |peer: SocketAddr| (*counts.entry(peer.ip()).and_modify(|count| *count += 1).or_default(), peer);
    let mut placed: Vec<_> = best_first.into_iter().map(place).collect();
    // The second of an address comes behind the first of all addresses.
    placed.sort_by_key(|&(place, _)| place);
    placed.into_iter().skip(most).map(|(_, peer)| peer).collect()
}

/// Returns the connections to where the session listens that are not open yet, by their addresses, and how much has
/// come from each.
fn strangers(open: &Mutex<HashSet<String>>) -> HashMap<SocketAddr, (ManuallyDrop<TcpStream>, u64)> {
    let (mut listening, mut found) = (HashSet::new(), Vec::new());
    for (socket, received) in threads::sockets() {
        match (socket.local_addr(), socket.peer_addr()) {
            (Ok(here), Ok(peer)) => found.push((here.port(), (peer, (socket, received)))),
            (Ok(here), Err(_)) => drop(listening.insert(here.port())),
            _ => {}
        }
    }
    let open = locked(open);
    found.retain(|(port, (peer, _))| listening.contains(port) && !open.contains(&peer.to_string()));
    found.into_iter().map(|(_, stranger)| stranger).collect()
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn the_oldest_silent_ones_of_the_address_that_has_most_go() {
        let peer = |host, port| SocketAddr::from(([127, 0, 0, host], port));
        let mut oldest_first = vec![peer(2, 0)];
        oldest_first.extend((0..=MOST as u16).map(|port| peer(1, port)));
        assert_eq!(too_many(&oldest_first, MOST, |peer| peer.port() == 0), [peer(1, 2), peer(1, 1)]);
        assert_eq!(too_many(&oldest_first[..MOST], MOST, |_| false), []);
    }

    #[test]
    fn a_client_that_connects_before_the_first_look_is_no_stranger() {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let opened = |mode, endpoints| {
            let mut config = zenoh::Config::default();
            config.insert_json5("mode", mode).unwrap();
            config.insert_json5("scouting/multicast/enabled", "false").unwrap();
            config.insert_json5(endpoints, &format!("[\"tcp/127.0.0.1:{port}\"]")).unwrap();
            zenoh::open(config).wait().unwrap()
        };
        let node = opened("'peer'", "listen/endpoints");
        let _client = opened("'client'", "connect/endpoints");
        while node.info().links().wait().next().is_none() {}
        let open = links(&node).unwrap();
        assert_eq!((strangers(&open).len(), locked(&open).len()), (0, 1));
    }
}
