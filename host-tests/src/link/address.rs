//! Where a controller is reached.

use std::fmt;
use std::str::FromStr;

/// A serial device, or a TCP port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A serial device or a pseudo-terminal, by its path.
    Serial(String),
    /// `host:port`.
    Tcp(String),
}

impl FromStr for Address {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let Some(address) = text.strip_prefix("tcp:") else {
            return if text.is_empty() {
                Err("give a serial device, a pseudo-terminal or tcp:HOST:PORT")
            } else {
                Ok(Self::Serial(text.to_owned()))
            };
        };
        let port = address
            .rsplit_once(':')
            .filter(|(host, _)| !host.is_empty())
            .and_then(|(_, port)| port.parse::<u16>().ok());
        match port {
            Some(1..) => Ok(Self::Tcp(address.to_owned())),
            _ => Err("a TCP port is given as tcp:HOST:PORT, as in tcp:127.0.0.1:5000"),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => f.write_str(path),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_and_tcp_ports_are_told_apart() {
        let serial = |path: &str| Ok(Address::Serial(path.to_owned()));
        let tcp = |address: &str| Ok(Address::Tcp(address.to_owned()));
        assert_eq!("/dev/ttyACM0".parse(), serial("/dev/ttyACM0"));
        assert_eq!("COM3".parse(), serial("COM3"));
        assert_eq!("tcp:127.0.0.1:23".parse(), tcp("127.0.0.1:23"));
        assert_eq!("tcp:[::1]:23".parse(), tcp("[::1]:23"));
        for bad in [
            "",
            "tcp:",
            "tcp:23",
            "tcp::23",
            "tcp:host",
            "tcp:host:0",
            "tcp:host:70000",
        ] {
            assert!(bad.parse::<Address>().is_err(), "{bad}");
        }
    }
}
