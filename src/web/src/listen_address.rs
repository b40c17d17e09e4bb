//! The address on which a person lets a program listen.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::str::FromStr;

/// Where to listen, as a person writes it: `127.0.0.1:8430`, `[::1]:8430`, `localhost:8430` or another name of this
/// machine; `8430` and `:8430` for this machine alone.
///
/// ```
/// use relit_web::ListenAddress;
///
/// let address: ListenAddress = "8430".parse()?;
/// assert_eq!(address.socket().to_string(), "127.0.0.1:8430");
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListenAddress {
    socket: SocketAddr,
    name: Option<String>,
}

impl ListenAddress {
    /// The address to listen on.
    pub fn socket(&self) -> SocketAddr {
        self.socket
    }

    /// The names under which clients reach this machine: those that are `given`, and the one in the address.
    pub fn names(&self, given: &[String]) -> Vec<String> {
        given.iter().chain(&self.name).cloned().collect()
    }
}

impl FromStr for ListenAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if let Ok(socket) = text.parse() {
            return Ok(Self { socket, name: None });
        }
        if text.contains("://") {
            let url = "this is a URL: give the address and the port alone, such as localhost:8430";
            return Err(url.to_owned());
        }
        let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        let (host, port) = match text.rsplit_once(':') {
            _ if is_number => ("", text),
            _ if text.ends_with(']') => return Err(no_port(text)),
            Some(parts) => parts,
            None => return Err(no_port(text)),
        };
        // What follows the last colon may be a port, or belong to the address.
        if let Ok(address) = host.parse::<Ipv6Addr>() {
            let why = format!("an IPv6 address stands in brackets: give [{address}]:PORT");
            return Err(why);
        }
        if let Ok(address) = text.parse::<Ipv6Addr>() {
            return Err(no_port(&format!("[{address}]")));
        }
        let port: u16 = port.parse().map_err(|_| {
            format!(
                "{port:?} is not a port: give a number from 0 to 65535 after the colon, 0 for any free port"
            )
        })?;
        if host.is_empty() {
            let socket = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port);
            return Ok(Self { socket, name: None });
        }
        Ok(Self {
            socket: look_up(host, port)?,
            // Who asks for this machine by that name, on it, gets in anyway.
            name: (!host.eq_ignore_ascii_case("localhost")).then(|| host.to_owned()),
        })
    }
}

fn no_port(address: &str) -> String {
    format!("the port is missing: give ADDRESS:PORT, such as {address}:8430")
}

/// The address of a name: that of IPv4 where there are both, as where no name is given.
fn look_up(name: &str, port: u16) -> Result<SocketAddr, String> {
    let unknown = |why: String| {
        format!(
            "{name:?} is not the name of this machine or an address ({why}): give localhost:PORT or 0.0.0.0:PORT"
        )
    };
    let found = (name, port).to_socket_addrs();
    let found = found.map_err(|why| unknown(why.to_string()))?;
    found
        .min_by_key(SocketAddr::is_ipv6)
        .ok_or_else(|| unknown("it has none".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn socket(text: &str) -> String {
        let address: ListenAddress = text.parse().unwrap();
        address.socket().to_string()
    }

    fn fault(text: &str) -> String {
        text.parse::<ListenAddress>().unwrap_err()
    }

    #[test]
    fn an_address_is_what_people_write_for_it() {
        for (text, meant) in [
            ("127.0.0.1:8430", "127.0.0.1:8430"),
            ("0.0.0.0:0", "0.0.0.0:0"),
            ("[::1]:8430", "[::1]:8430"),
            ("[::]:8430", "[::]:8430"),
            ("8430", "127.0.0.1:8430"),
            (":8430", "127.0.0.1:8430"),
        ] {
            assert_eq!(socket(text), meant, "{text}");
        }
    }

    #[test]
    fn localhost_is_this_machine_and_no_further_name_of_it() {
        for text in ["localhost:8430", "LOCALHOST:8430"] {
            let address: ListenAddress = text.parse().unwrap();
            assert!(address.socket().ip().is_loopback(), "{text}");
            assert_eq!(address.socket().port(), 8430);
            assert_eq!(address.names(&[]), Vec::<String>::new());
        }
    }

    #[test]
    fn a_name_in_the_address_is_one_under_which_clients_come() {
        let address = ListenAddress {
            socket: "192.0.2.7:8430".parse().unwrap(),
            name: Some("rig.local".to_owned()),
        };
        assert_eq!(address.names(&["rig".to_owned()]), ["rig", "rig.local"]);
    }

    #[test]
    fn what_is_no_address_is_refused_for_what_it_is() {
        // By what is to be given instead.
        let asks_for = |text: &str, ways_out: &[&str]| {
            let said = fault(text);
            assert!(
                ways_out.iter().any(|way_out| said.contains(way_out)),
                "{text}: {said}"
            );
        };
        let (port, brackets) = ("65535", "]:PORT");
        for text in ["http://localhost:8430", "https://0.0.0.0"] {
            asks_for(text, &[" localhost:8430"]);
        }
        for text in ["localhost", "0.0.0.0", "::1", "[::1]", "", "rig.local"] {
            asks_for(text, &["ADDRESS:PORT"]);
        }
        for text in [
            "localhost:",
            "localhost:84300",
            "65536",
            "127.0.0.1:x",
            ":-1",
            "[::1]:",
            "::1:x",
        ] {
            asks_for(text, &[port, brackets]);
        }
        for text in ["::1:8430", "::1:84300", "fe80::1:8430"] {
            asks_for(text, &[brackets]);
        }
        asks_for("fe80::1:8430x", &[port, brackets]);
        asks_for("a b:8430", &["\"a b\""]);
    }
}
