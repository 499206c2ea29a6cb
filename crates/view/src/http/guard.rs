//! Who may ask: whoever has the token, from the page's own origin.

use std::fmt;

/// The secret in the page's address, 128 random bits as 32 hexadecimal digits. It is not printed by
/// `{:?}`.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Token(String);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// A token that nobody can guess.
    pub(super) fn random() -> std::io::Result<Self> {
        let mut bytes = [0_u8; 16];
        getrandom::fill(&mut bytes).map_err(|e| std::io::Error::other(e.to_string()))?;
        Ok(Self(bytes.iter().map(|b| format!("{b:02x}")).collect()))
    }

    pub(super) fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether this is it. The time that this takes does not depend on where they differ.
    pub(super) fn is(&self, offered: &str) -> bool {
        let (known, offered) = (self.0.as_bytes(), offered.as_bytes());
        let differences = known.iter().zip(offered).fold(0, |d, (a, b)| d | (a ^ b));
        known.len() == offered.len() && differences == 0
    }
}

/// What a request says about where it comes from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OriginHeaders<'a> {
    pub(super) host: Option<&'a str>,
    pub(super) origin: Option<&'a str>,
    /// `Sec-Fetch-Site`, which browsers send.
    pub(super) site: Option<&'a str>,
}

/// Why a request is refused, if it is.
///
/// A page of another site can make a browser send requests here. If that site's name is made to
/// resolve to 127.0.0.1 (DNS rebinding), `Host` still names the site. Other requests from other
/// sites have an `Origin` or a `Sec-Fetch-Site` that is not ours.
pub(super) fn refusal(port: u16, headers: OriginHeaders<'_>) -> Option<&'static str> {
    let ours = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_ours = |host: &str| ours.iter().any(|o| o.eq_ignore_ascii_case(host));
    if !headers.host.is_some_and(is_ours) {
        return Some("Host: must be the address that was printed");
    }
    let is_from_us = |origin: &str| origin.strip_prefix("http://").is_some_and(is_ours);
    if headers.origin.is_some_and(|origin| !is_from_us(origin)) {
        return Some("Origin: must be this page");
    }
    // `none` is what somebody typed or pasted.
    let is_near = |site: &str| ["same-origin", "none"].contains(&site);
    if headers.site.is_some_and(|site| !is_near(site)) {
        return Some("Sec-Fetch-Site: must be this page");
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_long_secret_and_different() {
        let (a, b) = (Token::random().unwrap(), Token::random().unwrap());
        assert_ne!(a, b);
        assert_eq!(a.as_str().len(), 32);
        assert!(a.is(a.as_str()) && !a.is(b.as_str()) && !a.is("") && !a.is(&a.as_str()[..31]));
        assert!(!format!("{a:?}").contains(&a.as_str()[..4]));
    }

    #[test]
    fn only_the_page_itself_may_ask() {
        let ask = |host, origin, site| refusal(8080, OriginHeaders { host, origin, site });
        for host in ["127.0.0.1:8080", "localhost:8080", "LOCALHOST:8080"] {
            assert_eq!(ask(Some(host), None, None), None, "{host}");
        }
        let strangers = [
            "127.0.0.1",
            "127.0.0.1:80",
            "evil.example:8080",
            "127.0.0.1:8080.evil",
            "",
        ];
        for host in strangers {
            assert!(ask(Some(host), None, None).is_some(), "{host}");
        }
        assert!(ask(None, None, None).is_some());
        let host = Some("127.0.0.1:8080");
        assert_eq!(
            ask(host, Some("http://127.0.0.1:8080"), Some("same-origin")),
            None
        );
        assert_eq!(ask(host, None, Some("none")), None);
        for origin in ["null", "https://127.0.0.1:8080", "http://evil.example", ""] {
            assert!(ask(host, Some(origin), None).is_some(), "{origin}");
        }
        for site in ["cross-site", "same-site", ""] {
            assert!(ask(host, None, Some(site)).is_some(), "{site}");
        }
    }
}
