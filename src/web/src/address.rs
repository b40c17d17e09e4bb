//! Under which addresses a server is reached, and how a phone gets to know.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;

use crate::token::Token;

/// How clients reach the server, for the person who started it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Announcement {
    /// The address that is listened on, with its real port.
    pub address: SocketAddr,
    /// What to open in a browser; holds the token where there is one.
    pub url: String,
    /// The URL as a QR code for a dark terminal, lines of half blocks. `None` if it does not fit into
    /// one.
    pub qr: Option<String>,
}

impl Announcement {
    /// How to reach a server at `address`, by the first of `names` if there is one.
    pub fn new(address: SocketAddr, names: &[String], token: Option<&Token>) -> Self {
        let port = address.port();
        let place = match names.first() {
            Some(name) => format!("{name}:{port}"),
            None => SocketAddr::new(reachable(address.ip()), port).to_string(),
        };
        let url = match token {
            Some(token) => format!("http://{place}/?token={}", token.reveal()),
            None => format!("http://{place}/"),
        };
        let code = QrCode::new(&url).ok();
        Self {
            address,
            qr: code.map(|code| code.render::<Dense1x2>().build()),
            url,
        }
    }
}

/// An address that others can use: where all are listened on, the one from which this machine would
/// speak to the world. No packet is sent to find it.
fn reachable(ip: IpAddr) -> IpAddr {
    if !ip.is_unspecified() {
        return ip;
    }
    // Addresses for documentation (RFC 5737, RFC 3849): routed like any in the world, nobody's.
    let (local, remote): (IpAddr, IpAddr) = match ip {
        IpAddr::V4(_) => (ip, Ipv4Addr::new(192, 0, 2, 1).into()),
        IpAddr::V6(_) => (ip, Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1).into()),
    };
    let route = || {
        let socket = UdpSocket::bind((local, 0))?;
        socket.connect((remote, 9))?;
        socket.local_addr()
    };
    match route() {
        Ok(address) => address.ip(),
        Err(_) if ip.is_ipv6() => Ipv6Addr::LOCALHOST.into(),
        Err(_) => Ipv4Addr::LOCALHOST.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_announced_url_can_be_opened_and_holds_the_token() {
        let token: Token = "0123456789abcdef".parse().unwrap();
        let announced = Announcement::new("192.0.2.7:8420".parse().unwrap(), &[], Some(&token));
        assert_eq!(
            announced.url,
            "http://192.0.2.7:8420/?token=0123456789abcdef"
        );
        assert!(announced.qr.unwrap().lines().count() > 10);
        let names = ["rig.local".to_owned()];
        let announced = Announcement::new("[::1]:80".parse().unwrap(), &names, None);
        assert_eq!(announced.url, "http://rig.local:80/");
        let announced = Announcement::new("[::1]:80".parse().unwrap(), &[], None);
        assert_eq!(announced.url, "http://[::1]:80/");
    }

    #[test]
    fn an_address_for_all_is_announced_as_one_that_can_be_reached() {
        let announced = Announcement::new("0.0.0.0:8420".parse().unwrap(), &[], None);
        assert!(!announced.url.contains("0.0.0.0"), "{}", announced.url);
    }
}
