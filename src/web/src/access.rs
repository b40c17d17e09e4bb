//! Who gets in: the name under which the server is addressed, the page from which a request comes, the
//! token; and the headers that limit what a browser may use the answers for.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::failure::Failure;
use crate::token::Token;

/// How long a browser keeps the token, seconds: 30 days.
const KEPT_S: u32 = 30 * 24 * 3600;

/// On every answer. The page loads nothing from elsewhere, and no other page shows or embeds it.
const HEADERS: [(HeaderName, &str); 6] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
];

/// The address of this machine that a connection was made to.
#[derive(Debug, Clone, Copy)]
pub struct LocalAddress(pub IpAddr);

/// Which requests are let in.
#[derive(Debug)]
pub struct AccessPolicy {
    token: Option<Token>,
    names: Vec<String>,
    /// Paths that need no token.
    open_paths: Vec<&'static str>,
    /// Browsers share cookies between ports: the name keeps two servers on one machine apart.
    cookie: String,
}

impl AccessPolicy {
    /// The policy of a server at `port` that demands `token`, save for `open_paths`, and is known
    /// under `names` besides its addresses.
    pub fn new(
        port: u16,
        token: Option<Token>,
        names: Vec<String>,
        open_paths: Vec<&'static str>,
    ) -> Self {
        Self {
            token,
            names,
            open_paths,
            cookie: format!("relit-{port}"),
        }
    }

    fn admit(&self, local: IpAddr, uri: &Uri, headers: &HeaderMap) -> Result<(), Failure> {
        let host = self.host(local, headers)?;
        check_origin(host, headers)?;
        if self.open_paths.contains(&uri.path()) || self.is_authorised(headers) {
            return Ok(());
        }
        let error = "this needs the token: open the address that was printed at the start, or send \
                     the token as \"Authorization: Bearer\"";
        Err(Failure::new(StatusCode::UNAUTHORIZED, error))
    }

    /// The `Host` header, if it names this machine. A page of another site whose name was made to
    /// lead here (DNS rebinding) still sends its own name.
    fn host<'a>(&self, local: IpAddr, headers: &'a HeaderMap) -> Result<&'a str, Failure> {
        let mut hosts = headers.get_all(header::HOST).iter();
        let (Some(host), None) = (hosts.next(), hosts.next()) else {
            return Err(Failure::bad_request("the request needs one Host header"));
        };
        let host = host.to_str().unwrap_or("");
        let name = without_port(host);
        let is_local = match name.parse::<IpAddr>() {
            Ok(ip) => ip == local.to_canonical(),
            Err(_) => name.eq_ignore_ascii_case("localhost") && local.to_canonical().is_loopback(),
        };
        if is_local || self.names.iter().any(|own| own.eq_ignore_ascii_case(name)) {
            return Ok(host);
        }
        let error = "the request is for another machine's name: use this machine's address, or start \
                     the server with that name";
        Err(Failure::new(StatusCode::MISDIRECTED_REQUEST, error))
    }

    /// True where no token is requested, or the right one came.
    pub fn is_authorised(&self, headers: &HeaderMap) -> bool {
        let Some(token) = &self.token else {
            return true;
        };
        bearer(headers).is_some_and(|given| token.is(given))
            || cookies(headers).any(|(name, value)| name == self.cookie && token.is(value))
    }

    /// True where no token is requested.
    pub fn is_open(&self) -> bool {
        self.token.is_none()
    }

    /// The cookie that lets a browser in, if `given` is the token.
    pub fn cookie_for(&self, given: &str) -> Option<String> {
        let token = self.token.as_ref().filter(|token| token.is(given))?;
        Some(format!(
            "{}={}; Path=/; Max-Age={KEPT_S}; HttpOnly; SameSite=Strict",
            self.cookie,
            token.reveal()
        ))
    }
}

/// The host without port and brackets.
fn without_port(host: &str) -> &str {
    if let Some((v6, _)) = host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        return v6;
    }
    host.rsplit_once(':').map_or(host, |(name, _)| name)
}

/// A browser says from which page a request comes, always where it changes something: it has to be
/// the page of this very server. Programs other than browsers send nothing.
fn check_origin(host: &str, headers: &HeaderMap) -> Result<(), Failure> {
    let own = |origin: &HeaderValue| {
        let origin = origin.to_str().unwrap_or("");
        ["http://", "https://"].iter().any(|scheme| {
            origin
                .strip_prefix(scheme)
                .is_some_and(|from| from.eq_ignore_ascii_case(host))
        })
    };
    if headers.get_all(header::ORIGIN).iter().all(own) {
        return Ok(());
    }
    let error = "the request comes from a page of another site: use the page of this server";
    Err(Failure::new(StatusCode::FORBIDDEN, error))
}

fn bearer(headers: &HeaderMap) -> Option<&str> {
    let given = headers.get(header::AUTHORIZATION)?.to_str().ok()?;
    let (scheme, token) = given.split_once(' ')?;
    scheme
        .eq_ignore_ascii_case("bearer")
        .then_some(token.trim())
}

fn cookies(headers: &HeaderMap) -> impl Iterator<Item = (&str, &str)> {
    let lines = headers.get_all(header::COOKIE).iter();
    lines
        .filter_map(|line| line.to_str().ok())
        .flat_map(|line| line.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
}

/// Lets a request through or refuses it, and gives the answer the headers that all have.
pub async fn guard(
    State(policy): State<Arc<AccessPolicy>>,
    request: Request,
    next: Next,
) -> Response {
    let local = request.extensions().get::<LocalAddress>().copied();
    let admitted = match local {
        Some(LocalAddress(ip)) => policy.admit(ip, request.uri(), request.headers()),
        None => Err(Failure::internal("the connection's address is not known")),
    };
    let mut response = match admitted {
        Ok(()) => next.run(request).await,
        Err(failure) => failure.into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        // A page that needs less than the server's own may say so.
        headers
            .entry(name)
            .or_insert(HeaderValue::from_static(value));
    }
    headers
        .entry(header::CACHE_CONTROL)
        .or_insert(HeaderValue::from_static("no-store"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(&'static str, &str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.append(*name, value.parse().unwrap());
        }
        headers
    }

    fn verdict(local: &str, path: &'static str, pairs: &[(&'static str, &str)]) -> u16 {
        let token = "0123456789abcdef".parse().unwrap();
        let policy = AccessPolicy::new(80, Some(token), vec!["rig.local".to_owned()], vec!["/"]);
        let local = local.parse().unwrap();
        match policy.admit(local, &Uri::from_static(path), &headers(pairs)) {
            Ok(()) => 200,
            Err(failure) => failure.status().as_u16(),
        }
    }

    #[test]
    fn only_names_of_this_machine_are_served() {
        for (local, host, wanted) in [
            ("127.0.0.1", "127.0.0.1:80", 200),
            ("127.0.0.1", "localhost", 200),
            ("::ffff:192.0.2.7", "192.0.2.7:80", 200),
            ("::1", "[::1]:80", 200),
            ("192.0.2.7", "RIG.local:80", 200),
            ("192.0.2.7", "localhost", 421),
            ("192.0.2.7", "192.0.2.8", 421),
            ("127.0.0.1", "evil.example", 421),
            ("127.0.0.1", "localhost.evil.example", 421),
            ("127.0.0.1", "", 421),
        ] {
            assert_eq!(verdict(local, "/", &[("host", host)]), wanted, "{host}");
        }
        assert_eq!(verdict("127.0.0.1", "/", &[]), 400);
        let two = [("host", "localhost"), ("host", "localhost")];
        assert_eq!(verdict("127.0.0.1", "/", &two), 400);
    }

    #[test]
    fn requests_from_other_sites_pages_are_refused() {
        for (origin, wanted) in [
            ("http://localhost:80", 200),
            ("https://localhost:80", 200),
            ("http://localhost:3000", 403),
            ("http://evil.example", 403),
            ("null", 403),
        ] {
            let pairs = [("host", "localhost:80"), ("origin", origin)];
            assert_eq!(verdict("127.0.0.1", "/", &pairs), wanted, "{origin}");
        }
    }

    #[test]
    fn the_token_comes_as_bearer_or_as_cookie_of_this_port() {
        let host = ("host", "localhost");
        for (pair, wanted) in [
            (("accept", "*/*"), 401),
            (("authorization", "Bearer 0123456789abcdef"), 200),
            (("authorization", "bearer 0123456789abcdef"), 200),
            (("authorization", "Bearer 0123456789abcdee"), 401),
            (("authorization", "Basic 0123456789abcdef"), 401),
            (("cookie", "a=b; relit-80=0123456789abcdef"), 200),
            (("cookie", "relit-81=0123456789abcdef"), 401),
        ] {
            let got = verdict("127.0.0.1", "/api/v1/state", &[host, pair]);
            assert_eq!(got, wanted, "{pair:?}");
        }
    }
}
