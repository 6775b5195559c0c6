//! Video memory: four planes, and the latches between them and the CPU.

use crate::monitor::NEEDED;
use crate::ports::PLANE_BYTES;

/// Bytes of a page in each plane.
pub(crate) const PAGE_BYTES: usize = NEEDED.stride * (NEEDED.down.shown / NEEDED.repeat);
/// The end of the last page that fits.
pub(crate) const PAGES_END: usize = PLANE_BYTES / PAGE_BYTES * PAGE_BYTES;

/// Four planes of 64 KiB, and a latch for each.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    planes: Vec<[u8; 4]>,
    latches: [u8; 4],
}

impl Default for Memory {
    /// Fills memory with a pattern that no scene draws, because memory is undefined at power-on.
    fn default() -> Self {
        Self {
            planes: (0..PLANE_BYTES)
                .map(|at| [0xA5 ^ at as u8, 0x5A, 0xC3, 0x3C])
                .collect(),
            latches: [0; 4],
        }
    }
}

impl Memory {
    /// Write mode 0 with nothing rotated, masked or set: the byte goes to the planes of the mask.
    pub fn store(&mut self, at: u16, value: u8, map_mask: u8) {
        for (plane, byte) in self.planes[usize::from(at)].iter_mut().enumerate() {
            if map_mask >> plane & 1 == 1 {
                *byte = value;
            }
        }
    }

    /// Read mode 0: every load fills all four latches, and returns the selected one.
    pub fn load(&mut self, at: u16, plane: u8) -> u8 {
        self.latches = self.planes[usize::from(at)];
        self.latches[usize::from(plane & 3)]
    }

    /// Returns a byte of a plane without filling a latch.
    pub fn peek(&self, plane: usize, at: u16) -> u8 {
        self.planes[usize::from(at)][plane]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No scene stores from the latches, and a load returns only one, so this is the only place that checks
    /// all four.
    #[test]
    fn every_load_fills_all_four_latches() {
        let mut memory = Memory::default();
        for plane in 0..4 {
            memory.store(7, 20 + plane, 1 << plane);
        }
        for plane in 0..4 {
            memory.latches = [0; 4];
            memory.load(7, plane);
            assert_eq!(memory.latches, [20, 21, 22, 23]);
        }
    }
}
