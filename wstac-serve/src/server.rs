//! Listens for clients, each in a thread of its own.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, Scope};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tungstenite::handshake::derive_accept_key;
use wstac_host::error::{Error, ErrorKind};

use crate::access::{Access, Token};
use crate::client;
use crate::http::{HttpRefusal, Request, refuse};
use crate::hub::{About, Hub};
use crate::page;
use crate::sensor::ServedSensor;

/// Most connections at once.
const MOST: usize = 64;
/// The longest wait between two checks for the end.
const WAIT: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
/// A pause after a failure to take a connection, such as too many open files.
const PAUSE: Duration = Duration::from_millis(50);

/// A server that shows sensors on a page.
///
/// ```no_run
/// use std::sync::atomic::AtomicBool;
/// use wstac_host::config::Config;
/// use wstac_host::output::OutputOptions;
/// use wstac_host::source::{Source, open::{OpenOptions, open}};
/// use wstac_host::station::Station;
/// use wstac_host::texture::Textures;
/// use wstac_serve::{ServedSensor, Server, Tools};
///
/// let source = open("slide.y4m", &OpenOptions::default(), &[])?;
/// let info = source.info().clone();
/// let station = Station::new(source, info, Config::default(), Textures::default(), OutputOptions::LIVE)?;
/// // Pages can go back in a file that can be opened again.
/// let reopen = || {
///     let source = open("slide.y4m", &OpenOptions::default(), &[])?;
///     let info = source.info().clone();
///     Ok((source, info))
/// };
/// let station = station.paced().reopened_by(Box::new(reopen), false);
/// let sensor = ServedSensor::new(None, station, Tools::default());
/// let server = Server::bind("127.0.0.1:0".parse().expect("an address"), None)?;
/// println!("{}", server.address());
/// server.run(vec![sensor], &AtomicBool::new(false), &|name, line| eprintln!("{name:?}: {line}"));
/// # Ok::<(), wstac_host::error::Error>(())
/// ```
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    bound: SocketAddr,
    access: Access,
}

impl Server {
    /// Listens at an address. Port 0 is any free one.
    ///
    /// An address that other machines reach needs a token: there is a random one if `token` is `None`.
    ///
    /// # Errors
    /// The address is taken or not one of this machine, or there are no random numbers.
    pub fn bind(address: SocketAddr, token: Option<Token>) -> Result<Self, Error> {
        let failed = |error: io::Error| match error.kind() {
            io::ErrorKind::AddrInUse => {
                let message = "is taken, expected a free address; port 0 is any free port";
                Error::new(ErrorKind::Busy, address, message).caused_by(error)
            }
            _ => Error::io(address, error),
        };
        let token = match token {
            None if !address.ip().is_loopback() => Some(Token::random()?),
            token => token,
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let bound = listener.local_addr().map_err(failed)?;
        Ok(Self { listener, bound, access: Access::new(bound.ip(), token) })
    }

    /// Returns the address to open in a browser, with the token if there is one.
    pub fn address(&self) -> String {
        let mut address = format!("http://{}/", SocketAddr::new(reachable(self.bound.ip()), self.bound.port()));
        if let Some(token) = &self.access.token {
            // Writing to a string does not fail.
            let _ = write!(address, "?token={}", token.as_str());
        }
        address
    }

    /// Serves sensors until `stop` is set, and returns the number of sensors whose source or recording has failed.
    ///
    /// The page stays after the sources have ended. A recording in progress is completed at the end. `tell` gets the
    /// name of a sensor and a line about it: why its source has failed, what was recorded, what was written.
    pub fn run(
        self,
        sensors: Vec<ServedSensor>,
        stop: &AtomicBool,
        tell: &(dyn Fn(Option<&str>, &str) + Sync),
    ) -> usize {
        let hub = Hub::new(sensors.iter().map(|sensor| sensor.about().clone()));
        let (hub, access, connections) = (&hub, &self.access, &AtomicUsize::new(0));
        let failures = &AtomicUsize::new(0);
        thread::scope(|scope| {
            for (number, sensor) in sensors.into_iter().enumerate() {
                scope.spawn(move || {
                    let About { name, .. } = sensor.about().clone();
                    if !sensor.run(number, hub, &|line| tell(name.as_deref(), line)) {
                        failures.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
            while !stop.load(Ordering::Relaxed) {
                // An error of it shows again at once when a connection is taken.
                let _ = poll(&mut [PollFd::new(&self.listener, PollFlags::IN)], Some(&WAIT));
                match self.listener.accept() {
                    Ok((stream, _)) => start(scope, stream, access, hub, connections),
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    Err(_) => thread::sleep(PAUSE),
                }
            }
            hub.end();
        });
        failures.load(Ordering::Relaxed)
    }
}

/// Returns an address by which this machine is reached: for all addresses, that of its way to the network.
fn reachable(bound: IpAddr) -> IpAddr {
    if !bound.is_unspecified() {
        return bound;
    }
    // Connecting a datagram socket sends nothing. The address is one for documentation, which nobody has.
    let (own, other): (IpAddr, &str) = match bound {
        IpAddr::V4(_) => (Ipv4Addr::LOCALHOST.into(), "192.0.2.1:9"),
        IpAddr::V6(_) => (Ipv6Addr::LOCALHOST.into(), "[2001:db8::1]:9"),
    };
    let found = UdpSocket::bind((bound, 0)).and_then(|socket| {
        socket.connect(other)?;
        socket.local_addr()
    });
    found.map_or(own, |address| address.ip())
}

/// Starts a thread for a connection, or refuses it if there are too many.
fn start<'s>(
    scope: &'s Scope<'s, '_>,
    mut stream: TcpStream,
    access: &'s Access,
    hub: &'s Hub,
    connections: &'s AtomicUsize,
) {
    // On some systems, a connection inherits this from the listener.
    if stream.set_nonblocking(false).is_err() {
        return;
    }
    if connections.fetch_add(1, Ordering::Relaxed) >= MOST {
        connections.fetch_sub(1, Ordering::Relaxed);
        // A short answer goes into the socket's buffer. Whoever does not take it gets none.
        let _ = stream.set_write_timeout(Some(PAUSE));
        let _ = refuse(&mut stream, HttpRefusal::new(503, "too many connections are open"));
        return;
    }
    let serve = move || {
        // A connection that breaks is the client's affair.
        let _ = connection(stream, access, hub);
        connections.fetch_sub(1, Ordering::Relaxed);
    };
    if thread::Builder::new().name("client".to_owned()).spawn_scoped(scope, serve).is_err() {
        connections.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Answers one request.
fn connection(mut stream: TcpStream, access: &Access, hub: &Hub) -> io::Result<()> {
    let (request, rest) = match Request::read(&mut stream, || hub.is_over())? {
        None => return Ok(()),
        Some(Ok(found)) => found,
        Some(Err(refusal)) => return refuse(&mut stream, refusal),
    };
    if let Err(refusal) = access.check(&request) {
        return refuse(&mut stream, refusal);
    }
    if let Some(key) = &request.key {
        let accept = derive_accept_key(key.as_bytes());
        let head = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n";
        stream.write_all(format!("{head}Sec-WebSocket-Accept: {accept}\r\n\r\n").as_bytes())?;
        return client::serve(stream, rest, hub).map_err(io::Error::other);
    }
    match page::file(&request.path) {
        Some((kind, body)) => request.answer(&mut stream, kind, body.as_bytes()),
        None => refuse(&mut stream, HttpRefusal::new(404, "there is no such page")),
    }
}
