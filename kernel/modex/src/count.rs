//! Exact counts of the accesses that reach the card.

use crate::registers::{MAP_MASK, SEQUENCER};
use crate::{Bus, Lane, Purpose};

/// The accesses for one purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Port writes, Map Mask included.
    pub ports: u64,
    /// Port writes to Map Mask.
    pub map_mask: u64,
    /// Store instructions to video memory.
    pub stores: u64,
    /// Bytes that these stores carried (each reaches one to four planes).
    pub bytes: u64,
    /// Loads from video memory.
    pub loads: u64,
}

/// The accesses by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// [`Purpose::Setup`].
    pub setup: Tally,
    /// [`Purpose::Draw`].
    pub draw: Tally,
    /// [`Purpose::Erase`].
    pub erase: Tally,
    /// [`Purpose::Overlay`].
    pub overlay: Tally,
    /// [`Purpose::Flip`].
    pub flip: Tally,
}

impl Counts {
    /// Returns the tally of one purpose.
    pub fn of(&mut self, purpose: Purpose) -> &mut Tally {
        match purpose {
            Purpose::Setup => &mut self.setup,
            Purpose::Draw => &mut self.draw,
            Purpose::Erase => &mut self.erase,
            Purpose::Overlay => &mut self.overlay,
            Purpose::Flip => &mut self.flip,
        }
    }

    /// Returns each purpose's name and tally, in a fixed order.
    pub fn named(&self) -> [(&'static str, Tally); 5] {
        [
            ("setup", self.setup),
            ("draw", self.draw),
            ("erase", self.erase),
            ("overlay", self.overlay),
            ("flip", self.flip),
        ]
    }
}

/// A bus that forwards everything and counts what reaches the card.
#[derive(Debug)]
pub struct Counted<B> {
    bus: B,
    counts: Counts,
    purpose: Purpose,
}

impl<B> Counted<B> {
    /// Counts the accesses to `bus`, starting at zero.
    pub fn new(bus: B) -> Self {
        Self {
            bus,
            counts: Counts::default(),
            purpose: Purpose::Setup,
        }
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Returns the counts since the last call, and resets them to zero.
    pub fn take_counts(&mut self) -> Counts {
        core::mem::take(&mut self.counts)
    }

    /// Returns the bus underneath.
    pub fn inner(&mut self) -> &mut B {
        &mut self.bus
    }
}

impl<B: Bus> Bus for Counted<B> {
    fn out8(&mut self, port: u16, value: u8) {
        self.counts.of(self.purpose).ports += 1;
        self.bus.out8(port, value);
    }

    fn out16(&mut self, port: u16, value: u16) {
        let tally = self.counts.of(self.purpose);
        tally.ports += 1;
        if port == SEQUENCER && value.to_le_bytes()[0] == MAP_MASK {
            tally.map_mask += 1;
        }
        self.bus.out16(port, value);
    }

    fn in8(&mut self, port: u16) -> u8 {
        self.bus.in8(port)
    }

    fn in16(&mut self, port: u16) -> u16 {
        self.bus.in16(port)
    }

    fn store64(&mut self, at: u16, bytes: u64) {
        let tally = self.counts.of(self.purpose);
        tally.stores += 1;
        tally.bytes += 8;
        self.bus.store64(at, bytes);
    }

    fn load8(&mut self, at: u16) -> u8 {
        self.counts.of(self.purpose).loads += 1;
        self.bus.load8(at)
    }

    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>)) {
        let tally = self.counts.of(self.purpose);
        tally.stores += u64::from(len);
        tally.bytes += u64::from(len);
        self.bus.lane(at, len, draw);
    }

    fn purpose(&mut self, purpose: Purpose) {
        self.purpose = purpose;
        self.bus.purpose(purpose);
    }
}
