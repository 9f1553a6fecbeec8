//! A server of one page for browsers on this machine.
//!
//! It listens on the loopback address alone. Web sites that a user visits could still send requests there,
//! under a name of their own that they let point to it: requests for other hosts are refused.

use crate::interrupt::Interrupt;
use crate::streams;
use skep::{Error, Result};
use std::net::{Ipv4Addr, SocketAddr};
use std::time::{Duration, Instant};
use tiny_http::{Header, Method, Request, Response, Server, StatusCode};

/// The shortest time before a page that may change is made again.
const LEAST_AGE: Duration = Duration::from_secs(4);
/// The same as a multiple of the time that it took: making pages must not take much from the run.
const AGE_FACTOR: u32 = 20;
/// How often the server looks for an interruption.
const POLL: Duration = Duration::from_millis(200);
/// What a page may load: nothing but what is in it.
const HEADERS: [(&str, &str); 5] = [
    ("Content-Type", "text/html; charset=utf-8"),
    ("Cache-Control", "no-store"),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
];

/// Makes a page; whether it is final.
type Make<'a> = Box<dyn Fn() -> Result<(Vec<u8>, bool)> + 'a>;

/// The page, made anew from time to time.
pub struct Pages<'a> {
    make: Make<'a>,
    last: Option<Made>,
}

struct Made {
    bytes: Vec<u8>,
    is_final: bool,
    at: Instant,
    took: Duration,
}

impl<'a> Pages<'a> {
    /// `make` gives the page and whether it will stay so.
    pub fn new(make: impl Fn() -> Result<(Vec<u8>, bool)> + 'a) -> Pages<'a> {
        Pages { make: Box::new(make), last: None }
    }

    /// The page, at most so old as it may be.
    fn current(&mut self) -> Result<&[u8]> {
        let is_young = |made: &Made| {
            made.is_final || made.at.elapsed() < LEAST_AGE.max(made.took.saturating_mul(AGE_FACTOR))
        };
        let last = match self.last.take().filter(is_young) {
            Some(last) => last,
            None => {
                let started = Instant::now();
                let (bytes, is_final) = (self.make)()?;
                Made { bytes, is_final, at: Instant::now(), took: started.elapsed() }
            }
        };
        Ok(&self.last.insert(last).bytes)
    }
}

/// Serves a page at `/` until the user interrupts.
///
/// # Errors
/// A port that is taken; a page that cannot be made at the start; [`Error::Cancelled`].
pub fn serve(port: u16, mut pages: Pages, interrupt: &Interrupt) -> Result<()> {
    let failed = |problem: String| Error::argument("--serve", port, problem);
    let server = Server::http(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    let server = server.map_err(|error| failed(format!("a port that is free ({error})")))?;
    // What is wrong with the folder is said now, not in the browser.
    pages.current()?;
    let address = server.server_addr().to_ip().ok_or_else(|| failed("a port".to_owned()))?;
    streams::result(&format!("http://{address}/"));
    streams::notice("serving the report to this machine; Ctrl-C ends it");
    while interrupt.control_flow().is_continue() {
        let request = server.recv_timeout(POLL).map_err(|error| failed(error.to_string()))?;
        if let Some(request) = request {
            answer(request, address.port(), &mut pages);
        }
    }
    Err(Error::Cancelled)
}

fn answer(request: Request, port: u16, pages: &mut Pages) {
    let host = request.headers().iter().find(|header| header.field.equiv("Host"));
    let is_local = host.is_some_and(|host| is_own_host(host.value.as_str(), port));
    let path = request.url().split('?').next().unwrap_or_default();
    let (status, body) = if !is_local {
        (403, "This server answers requests for 127.0.0.1 and localhost alone.\n".to_owned().into_bytes())
    } else if *request.method() != Method::Get {
        (405, b"This server answers GET requests alone.\n".to_vec())
    } else if path != "/" && path != "/report.html" {
        (404, b"There is no such page; the report is at /.\n".to_vec())
    } else {
        match pages.current() {
            Ok(page) => (200, page.to_vec()),
            Err(error) => (500, format!("The page cannot be made: {error}\n").into_bytes()),
        }
    };
    let mut response = Response::from_data(body).with_status_code(StatusCode(status));
    for (name, value) in HEADERS {
        let is_text = name == "Content-Type" && status != 200;
        let value = if is_text { "text/plain; charset=utf-8" } else { value };
        if let Ok(header) = Header::from_bytes(name, value) {
            response.add_header(header);
        }
    }
    // A browser that went away does not matter.
    let _ = request.respond(response);
}

/// Whether a request's host is this machine by a name that no other machine can have.
fn is_own_host(host: &str, port: u16) -> bool {
    let names = ["127.0.0.1", "localhost"];
    names.iter().any(|name| host == format!("{name}:{port}") || (port == 80 && host == *name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_loopback_names_are_own_hosts() {
        assert!(is_own_host("127.0.0.1:8090", 8090) && is_own_host("localhost:8090", 8090));
        for foreign in ["example.org:8090", "127.0.0.1.example.org:8090", "127.0.0.1", "localhost:1", ""] {
            assert!(!is_own_host(foreign, 8090), "{foreign}");
        }
    }

    #[test]
    fn a_page_that_may_change_is_made_again_and_not_too_often() {
        let count = std::cell::Cell::new(0);
        let mut pages = Pages::new(|| {
            count.set(count.get() + 1);
            Ok((vec![count.get()], false))
        });
        assert_eq!(pages.current().unwrap(), [1]);
        assert_eq!(pages.current().unwrap(), [1]);
        pages.last.as_mut().unwrap().at -= LEAST_AGE;
        assert_eq!(pages.current().unwrap(), [2]);
    }
}
