//! Listens for clients. One thread serves them all, and waits for none.

use std::fmt::Write as _;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use wstac_host::error::{Error, ErrorKind};

use crate::access::{Access, Token};
use crate::client::PATIENCE;
use crate::connections::Connections;
use crate::hub::Hub;
use crate::sensor::ServedSensor;

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
    patience: Duration,
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
        Ok(Self { listener, bound, access: Access::new(bound.ip(), token), patience: PATIENCE })
    }

    /// Sets how long a page may acknowledge nothing, or take nothing, until it goes: 30 s by default.
    #[must_use]
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
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
        let hub = Hub::new(sensors.iter().map(|sensor| sensor.about.clone()));
        let (hub, failures) = (&hub, &AtomicUsize::new(0));
        thread::scope(|scope| {
            for (number, sensor) in sensors.into_iter().enumerate() {
                scope.spawn(move || {
                    let name = sensor.about.name.clone();
                    if !sensor.run(number, hub, &|line| tell(name.as_deref(), line)) {
                        failures.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
            let mut connections = Connections::new(&self.listener, &self.access, hub, self.patience);
            while !stop.load(Ordering::Relaxed) {
                connections.advance();
            }
            connections.end();
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
