//! Requests, and the text of measured figures.

use core::fmt;

use protocol::{ChecksumError, without_checksum};
use texmap::{Mapper, Order};

/// Most rounds of one measurement.
pub const MAX_ROUNDS: usize = 15;

/// A request, as a line contains it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchRequest {
    /// `calibrate`: measure the clock with a known number of instructions.
    Calibrate,
    /// `measure MAPPER ORDER ROUNDS`: measure each [`crate::Work`] in this many rounds, after a warm-up
    /// round.
    Measure(Mapper, Order, usize),
    /// `spans MAPPER ORDER ROUNDS`: measure faces whose spans all have one length, in RAM.
    Spans(Mapper, Order, usize),
    /// `check MAPPER ORDER`: print the checksum of what each work draws.
    Check(Mapper, Order),
    /// `leave`: end QEMU with the code for success.
    Leave,
}

/// Why a line is not a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchRequestError {
    /// The line is not one of the five requests.
    Unknown,
    /// The line has a checksum, which is wrong.
    Checksum(ChecksumError),
}

impl fmt::Display for BenchRequestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => write!(
                f,
                "unknown request; use calibrate, measure MAPPER ORDER ROUNDS, spans MAPPER ORDER ROUNDS, \
                 check MAPPER ORDER or leave; ROUNDS is 1 to {MAX_ROUNDS}"
            ),
            Self::Checksum(error) => error.fmt(f),
        }
    }
}

impl BenchRequest {
    /// Parses a line, and checks its checksum if it has one.
    ///
    /// # Errors
    /// If the line is not a request.
    pub fn parse(line: &str) -> Result<Self, BenchRequestError> {
        let text = match without_checksum(line) {
            Ok(text) => text,
            Err(ChecksumError::NoChecksum) => line,
            Err(wrong) => return Err(BenchRequestError::Checksum(wrong)),
        };
        Self::parse_words(text.split(' ')).ok_or(BenchRequestError::Unknown)
    }

    fn parse_words<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Self> {
        let name = words.next()?;
        let mut options = || Some((Mapper::parse(words.next()?)?, Order::parse(words.next()?)?));
        let mut request = match name {
            "calibrate" => Self::Calibrate,
            "leave" => Self::Leave,
            "measure" => options().map(|(mapper, order)| Self::Measure(mapper, order, 0))?,
            "spans" => options().map(|(mapper, order)| Self::Spans(mapper, order, 0))?,
            "check" => options().map(|(mapper, order)| Self::Check(mapper, order))?,
            _ => return None,
        };
        if let Self::Measure(_, _, rounds) | Self::Spans(_, _, rounds) = &mut request {
            *rounds = words.next()?.parse().ok()?;
            if !(1..=MAX_ROUNDS).contains(rounds) {
                return None;
            }
        }
        words.next().is_none().then_some(request)
    }
}

impl fmt::Display for BenchRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Calibrate => f.write_str("calibrate"),
            Self::Measure(mapper, order, rounds) => write!(f, "measure {mapper} {order} {rounds}"),
            Self::Spans(mapper, order, rounds) => write!(f, "spans {mapper} {order} {rounds}"),
            Self::Check(mapper, order) => write!(f, "check {mapper} {order}"),
            Self::Leave => f.write_str("leave"),
        }
    }
}

/// The measured ticks of a piece of work, one value a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figure {
    pixels: u64,
    ticks: [u64; MAX_ROUNDS],
    rounds: usize,
}

impl Figure {
    /// Returns a figure without rounds, for work that draws `pixels` pixels a round.
    pub fn new(pixels: u64) -> Self {
        Self {
            pixels,
            ..Self::default()
        }
    }

    /// Adds a round.
    ///
    /// # Panics
    /// If the figure already has [`MAX_ROUNDS`] rounds.
    pub fn add(&mut self, ticks: u64) {
        self.ticks[self.rounds] = ticks;
        self.rounds += 1;
    }

    /// Returns the pixels that a round draws.
    pub fn pixels(&self) -> u64 {
        self.pixels
    }

    /// Returns the clock's ticks of each round.
    pub fn ticks(&self) -> &[u64] {
        &self.ticks[..self.rounds]
    }

    /// Parses `pixels P ticks T ...`, as [`fmt::Display`] writes it.
    pub fn parse<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Self> {
        let number = |word: &str| -> Option<u64> {
            let digits = word.bytes().all(|b| b.is_ascii_digit());
            word.parse().ok().filter(|_| digits)
        };
        if words.next() != Some("pixels") {
            return None;
        }
        let mut figure = Self::new(number(words.next()?)?);
        if words.next() != Some("ticks") {
            return None;
        }
        for word in words {
            if figure.rounds == MAX_ROUNDS {
                return None;
            }
            figure.add(number(word)?);
        }
        (figure.rounds > 0).then_some(figure)
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "pixels {} ticks", self.pixels)?;
        self.ticks().iter().try_for_each(|n| write!(f, " {n}"))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_request_is_parsed_from_its_text() {
        let mut requests = std::vec![BenchRequest::Calibrate, BenchRequest::Leave];
        for &(_, mapper, _) in Mapper::ALL {
            for (_, order, _) in Order::ALL {
                requests.push(BenchRequest::Measure(mapper, order, 5));
                requests.push(BenchRequest::Spans(mapper, order, MAX_ROUNDS));
                requests.push(BenchRequest::Check(mapper, order));
            }
        }
        for request in requests {
            assert_eq!(BenchRequest::parse(&request.to_string()), Ok(request));
        }
    }

    #[test]
    fn an_illegal_request_is_refused() {
        for line in [
            "",
            "measure",
            "measure affine",
            "measure affine planes",
            "measure affine planes 0",
            "measure affine planes 16",
            "measure affine planes 5 5",
            "measure nothing planes 5",
            "measure affine sideways 5",
            "check affine planes 5",
            "calibrate 1",
            "leave now",
            "show 480",
        ] {
            assert_eq!(
                BenchRequest::parse(line),
                Err(BenchRequestError::Unknown),
                "{line:?}"
            );
        }
        let wrong = BenchRequest::parse("leave *00000000");
        assert!(matches!(wrong, Err(BenchRequestError::Checksum(_))));
    }

    #[test]
    fn a_figure_is_parsed_from_its_text() {
        let mut figure = Figure::new(76_800);
        for ticks in [0, 7, u64::MAX] {
            figure.add(ticks);
        }
        let text = figure.to_string();
        assert_eq!(text, "pixels 76800 ticks 0 7 18446744073709551615");
        assert_eq!(Figure::parse(text.split(' ')), Some(figure));
        for wrong in [
            "pixels 1 ticks",
            "pixels 1",
            "pixels -1 ticks 1",
            "pixels 1 ticks +1",
            "",
        ] {
            assert_eq!(Figure::parse(wrong.split(' ')), None, "{wrong:?}");
        }
    }
}
