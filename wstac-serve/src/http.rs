//! The part of HTTP that the page needs: heads of requests, read up to a limit, and answers.

use std::io::{self, ErrorKind};

/// Most bytes of a request's head.
pub(crate) const LONGEST_HEAD: usize = 8 * 1024;
const MOST_HEADERS: usize = 64;

/// The path of the WebSocket.
pub(crate) const SOCKET: &str = "/socket";

/// Headers of every answer. The page runs its own script only, and nobody may frame it.
const HEADERS: &str = "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; \
                       img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; \
                       frame-ancestors 'none'\r\n\
                       Cross-Origin-Resource-Policy: same-origin\r\n\
                       Referrer-Policy: no-referrer\r\n\
                       X-Content-Type-Options: nosniff\r\n\
                       Cache-Control: no-store\r\n\
                       Connection: close\r\n";

/// Why a request has no other answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HttpRefusal {
    pub(crate) status: u16,
    pub(crate) why: &'static str,
}

impl HttpRefusal {
    pub(crate) fn new(status: u16, why: &'static str) -> Self {
        Self { status, why }
    }
}

/// An answer: its head, and its body.
pub(crate) type Answer = (Vec<u8>, &'static [u8]);

/// The head of a request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) path: String,
    query: String,
    /// Whether the answer has no body.
    is_head: bool,
    pub(crate) host: String,
    pub(crate) origin: Option<String>,
    /// The key of a request for a WebSocket.
    pub(crate) key: Option<String>,
}

impl Request {
    /// Returns the value of a name in the address, as it stands there.
    pub(crate) fn query_value(&self, name: &str) -> Option<&str> {
        self.query.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='))
    }

    /// Returns whether this request needs the token. The scripts and the style are the same for everybody.
    pub(crate) fn needs_token(&self) -> bool {
        !matches!(self.path.as_str(), "/page.js" | "/tools.js" | "/page.css")
    }

    /// Parses the head of a request. It returns `None` if there is more to come, and how many bytes the head has.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Option<(Self, usize)>, HttpRefusal> {
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut head = httparse::Request::new(&mut headers);
        let length = match head.parse(bytes) {
            Ok(httparse::Status::Complete(length)) => length,
            Ok(httparse::Status::Partial) if bytes.len() < LONGEST_HEAD => return Ok(None),
            Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => {
                return Err(HttpRefusal::new(431, "the request has too many or too long headers"));
            }
            Err(_) => return Err(HttpRefusal::new(400, "the request is not HTTP")),
        };
        let (Some(method), Some(target)) = (head.method, head.path) else {
            return Err(HttpRefusal::new(400, "the request has no method or no path"));
        };
        if !matches!(method, "GET" | "HEAD") {
            return Err(HttpRefusal::new(405, "the method is neither GET nor HEAD"));
        }
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let mut request =
            Self { path: path.to_owned(), query: query.to_owned(), is_head: method == "HEAD", ..Self::default() };
        let value = |name: &str| -> Result<Option<String>, HttpRefusal> {
            let mut values = head.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
            let first = values.next().map(|header| String::from_utf8_lossy(header.value).trim().to_owned());
            match values.next() {
                Some(_) => Err(HttpRefusal::new(400, "a header is there twice")),
                None => Ok(first),
            }
        };
        request.host = value("Host")?.ok_or(HttpRefusal::new(400, "the header Host is missing"))?;
        request.origin = value("Origin")?;
        if path == SOCKET {
            let is_upgrade = value("Upgrade")?.is_some_and(|value| value.eq_ignore_ascii_case("websocket"));
            let is_version = value("Sec-WebSocket-Version")?.as_deref() == Some("13");
            let key = value("Sec-WebSocket-Key")?.filter(|key| !key.is_empty());
            request.key = key.filter(|_| is_upgrade && is_version && !request.is_head);
            if request.key.is_none() {
                return Err(HttpRefusal::new(426, "the address is that of a WebSocket, version 13"));
            }
        }
        Ok(Some((request, length)))
    }

    /// Returns the answer of a file of this media type.
    pub(crate) fn answer(&self, kind: &str, body: &'static str) -> Answer {
        let length = body.len();
        let head = format!("HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{HEADERS}\r\n");
        (head.into_bytes(), if self.is_head { &[] } else { body.as_bytes() })
    }
}

/// Returns whether an error says that there is nothing to read or no room to write yet.
pub(crate) fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// Returns the answer of a request that is refused.
pub(crate) fn refuse(refusal: HttpRefusal) -> Answer {
    let HttpRefusal { status, why } = refusal;
    let reason = match status {
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        426 => "Upgrade Required",
        431 => "Request Header Fields Too Large",
        _ => "Service Unavailable",
    };
    let more = match status {
        405 => "Allow: GET, HEAD\r\n",
        426 => "Upgrade: websocket\r\n",
        _ => "",
    };
    let length = why.len() + 1;
    let head = format!("HTTP/1.1 {status} {reason}\r\nContent-Type: text/plain\r\nContent-Length: {length}\r\n");
    (format!("{head}{more}{HEADERS}\r\n{why}\n").into_bytes(), &[])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Option<Request>, u16> {
        Request::parse(text.as_bytes()).map(|found| found.map(|(request, _)| request)).map_err(|refusal| refusal.status)
    }

    #[test]
    fn heads_are_read_with_what_the_page_needs() {
        let request = parse("GET /?a=b&token=x%20y HTTP/1.1\r\nhOST: localhost:1 \r\nOrigin: http://a\r\n\r\n");
        let request = request.unwrap().unwrap();
        assert_eq!((request.path.as_str(), request.host.as_str()), ("/", "localhost:1"));
        assert_eq!((request.query_value("token"), request.query_value("tok")), (Some("x%20y"), None));
        assert_eq!((request.origin.as_deref(), request.key), (Some("http://a"), None));
        assert_eq!(parse("GET / HTTP/1.1\r\nHost: a\r\n"), Ok(None));
        let upgrade = "GET /socket HTTP/1.1\r\nHost: a\r\nUpgrade: WebSocket\r\nSec-WebSocket-Version: 13\r\n";
        let request = parse(&format!("{upgrade}Sec-WebSocket-Key: k\r\n\r\n")).unwrap().unwrap();
        assert_eq!(request.key.as_deref(), Some("k"));
        assert_eq!(parse(&format!("{upgrade}\r\n")), Err(426));
    }

    #[test]
    fn other_requests_are_refused() {
        let many = "A: b\r\n".repeat(MOST_HEADERS + 1);
        for (text, status) in [
            ("POST / HTTP/1.1\r\nHost: a\r\n\r\n".to_owned(), 405),
            ("GET / HTTP/1.1\r\n\r\n".to_owned(), 400),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n".to_owned(), 400),
            ("GET / HTTP/1.1\r\nHost: a\r\nOrigin: b\r\norigin: c\r\n\r\n".to_owned(), 400),
            ("\u{16}\u{3}\u{1}\u{2}".to_owned(), 400),
            ("GET / HTTP/9\r\n\r\n".to_owned(), 400),
            (format!("GET /{} HTTP/1.1\r\n", "a".repeat(LONGEST_HEAD)), 431),
            (format!("GET / HTTP/1.1\r\nHost: a\r\n{many}\r\n"), 431),
            ("GET /socket HTTP/1.1\r\nHost: a\r\n\r\n".to_owned(), 426),
        ] {
            assert_eq!(parse(&text), Err(status), "{}", text.chars().take(60).collect::<String>());
        }
    }
}
