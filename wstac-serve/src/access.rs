//! Who may see the page: the headers Host and Origin, and the token.
//!
//! A page of another site can send requests to this machine from its visitor's browser. Such a request has the
//! other site's name as `Origin`. If that site has pointed its own name at this machine, it has this name as `Host`.

use std::fmt;
use std::fs::{self, File};
use std::io::Read;
use std::net::IpAddr;

use wstac_host::error::{Error, ErrorKind};

use crate::http::{HttpRefusal, Request};

/// Fewest and most characters of a token.
const LENGTH: std::ops::RangeInclusive<usize> = 16..=128;

/// A secret in the address of the page.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

/// Writes no token: messages are read by others.
impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

impl Token {
    /// Creates a token of 128 random bits.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub fn random() -> Result<Self, Error> {
        let name = "/dev/urandom";
        let mut bits = [0; 16];
        File::open(name).and_then(|mut file| file.read_exact(&mut bits)).map_err(|error| Error::io(name, error))?;
        Ok(Self(format!("{:032x}", u128::from_le_bytes(bits))))
    }

    /// Creates a token from a text. `name` says where it is from.
    ///
    /// ```
    /// use wstac_serve::Token;
    ///
    /// assert!(Token::new("a long one that nobody guesses", "the token").is_err());
    /// assert!(Token::new("a-long-one-that-nobody-guesses", "the token").is_ok());
    /// ```
    ///
    /// # Errors
    /// It is too short or too long, or has other characters than letters, digits, `-` and `_`.
    pub fn new(text: &str, name: impl fmt::Display) -> Result<Self, Error> {
        let is_right = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
        if LENGTH.contains(&text.len()) && text.bytes().all(is_right) {
            return Ok(Self(text.to_owned()));
        }
        let message = format!(
            "is no token (found {} characters), expected {} to {} letters, digits, - and _",
            text.chars().count(),
            LENGTH.start(),
            LENGTH.end()
        );
        Err(Error::new(ErrorKind::Usage, name, message))
    }

    /// Returns the token as it stands in the address.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns whether a text is the token, in a time that does not depend on where they differ.
    fn is(&self, given: &str) -> bool {
        let differences = self.0.bytes().zip(given.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
        self.0.len() == given.len() && differences == 0
    }
}

/// Who may see the page.
#[derive(Debug)]
pub(crate) struct Access {
    /// The address that the server listens at.
    pub(crate) bound: IpAddr,
    pub(crate) token: Option<Token>,
    /// This machine's own names.
    names: Vec<String>,
}

impl Access {
    pub(crate) fn new(bound: IpAddr, token: Option<Token>) -> Self {
        let mut names = vec!["localhost".to_owned()];
        // Names of the network are for addresses that it reaches.
        if !bound.is_loopback()
            && let Ok(name) = fs::read_to_string("/proc/sys/kernel/hostname")
        {
            let name = name.trim().to_ascii_lowercase();
            names.extend([format!("{name}.local"), name]);
        }
        Self { bound, token, names }
    }

    /// Refuses a request that is not from this server's own page, or that has no token where one is needed.
    pub(crate) fn check(&self, request: &Request) -> Result<(), HttpRefusal> {
        if !self.is_own(&request.host) {
            return Err(HttpRefusal::new(403, "the header Host has a foreign name"));
        }
        if let Some(origin) = &request.origin {
            let is_same = origin.strip_prefix("http://").is_some_and(|from| from.eq_ignore_ascii_case(&request.host));
            if !is_same {
                return Err(HttpRefusal::new(403, "the header Origin is that of another page"));
            }
        }
        let given = request.query_value("token").unwrap_or_default();
        match &self.token {
            Some(token) if request.needs_token() && !token.is(given) => Err(HttpRefusal::new(
                403,
                "the address has no token or a wrong one; wstac serve prints the right address",
            )),
            _ => Ok(()),
        }
    }

    /// Returns whether a header Host names this machine. Any port will do, because `ssh -L` brings others along.
    fn is_own(&self, host: &str) -> bool {
        let (name, port) = match host.strip_prefix('[') {
            Some(rest) => rest.split_once(']').unwrap_or(("", "")),
            None => host.split_at(host.find(':').unwrap_or(host.len())),
        };
        let is_port = |port: &str| port.parse::<u16>().is_ok();
        if !(port.is_empty() || port.strip_prefix(':').is_some_and(is_port)) {
            return false;
        }
        match name.parse::<IpAddr>() {
            Ok(address) if self.bound.is_unspecified() => !address.is_unspecified(),
            Ok(address) if self.bound.is_loopback() => address.is_loopback(),
            Ok(address) => address == self.bound,
            Err(_) => self.names.iter().any(|own| own.eq_ignore_ascii_case(name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_hosts_are_refused() {
        let access = |bound: &str| Access::new(bound.parse().unwrap(), None);
        let own = access("127.0.0.1");
        for host in ["127.0.0.1:8000", "127.0.0.1", "localhost:9", "LOCALHOST:8000", "[::1]:8000"] {
            assert!(own.is_own(host), "{host}");
        }
        let foreign = ["evil.example:8000", "127.0.0.1.evil.example", "", ":8000", "192.168.0.9:8000", "localhost:x"];
        for host in foreign.into_iter().chain(["[::1", "[::1]x", "localhost:", "127.0.0.1:99999", "localhost.:80"]) {
            assert!(!own.is_own(host), "{host}");
        }
        let network = access("0.0.0.0");
        assert!(network.is_own("192.168.0.9:8000") && !network.is_own("evil.example:8000"));
        let one = access("192.168.0.9");
        assert!(one.is_own("192.168.0.9:8000") && !one.is_own("192.168.0.8:8000") && !one.is_own("127.0.0.1:8000"));
    }

    #[test]
    fn tokens_are_compared_whole() {
        let token = Token::new("0123456789abcdef", "the token").unwrap();
        for (given, expected) in
            [("0123456789abcdef", true), ("0123456789abcdeX", false), ("0123456789abcde", false), ("", false)]
        {
            assert_eq!(token.is(given), expected, "{given}");
        }
        assert_ne!(Token::random().unwrap(), Token::random().unwrap());
        let error = Token::new("short", "FILE").unwrap_err().to_string();
        assert!(error.contains("found 5 characters"), "{error}");
        assert_eq!(format!("{token:?}"), "Token");
    }
}
