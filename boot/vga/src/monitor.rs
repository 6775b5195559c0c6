//! The timing that a monitor needs, and the timing that the registers give it.
//!
//! The values here are the emulated VGA's own. The registers give times in the chip's units, character clocks
//! across and scan lines down. [`Timing::of`] computes the times, and [`Timing::faults`] compares them with
//! the times that a VGA monitor needs for 320x240 ([`NEEDED`]).
//!
//! Sources: FreeVGA, "CRT Controller Registers" (how registers give times); VESA DMT 1.0, 640x480 at 60 Hz
//! (what a monitor needs); IBM, "VGA Technical Reference" (which sync polarity stands for which number of
//! lines, and the horizontal times of the 640-dot modes); Abrash, "Graphics Programming Black Book", chapter
//! 47 (the vertical times of 320x240).

use std::ops::Range;

use crate::fault::Complaint;

/// One direction of a frame: character clocks of a line, or scan lines of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct AxisTiming {
    pub total: usize,
    pub shown: usize,
    pub blank: Range<usize>,
    pub retrace: Range<usize>,
}

/// The timing and layout that the CRTC's registers give.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Timing {
    /// In character clocks.
    pub across: AxisTiming,
    /// In scan lines.
    pub down: AxisTiming,
    /// Scan lines for each line of pixels.
    pub repeat: usize,
    /// Bytes of a plane from one line to the next.
    pub stride: usize,
    /// The scan line from which the screen is split.
    pub compare: usize,
}

/// 320x240 on a VGA monitor.
pub(crate) const NEEDED: Timing = Timing {
    across: AxisTiming {
        // 800 dots: 31.469 kHz, the only line rate of a VGA monitor.
        total: 100,
        // 640 dots, two for each pixel.
        shown: 80,
        // No border on the right: it would show a colour of the palette.
        blank: 80..98,
        // A sync pulse of 96 dots, 3.8 us. It begins 32 dots after the display end.
        retrace: 84..96,
    },
    down: AxisTiming {
        // Two lines more than 640x480: 59.71 Hz instead of 59.94.
        total: 527,
        // Two for each line of pixels.
        shown: 480,
        blank: 487..518,
        // 10 lines after the display end, 2 lines long, as in 640x480.
        retrace: 490..492,
    },
    repeat: 2,
    // 320 pixels, a quarter of them in each plane.
    stride: 80,
    // No line has this number in any mode.
    compare: 1023,
};

/// Returns the first number after `start` whose low `bits` bits equal those of `end`. The chip compares only
/// these bits, so a period is 1 to 2^`bits` long.
fn end(start: usize, end: usize, bits: u32) -> usize {
    let next = start + 1;
    next + (end.wrapping_sub(next) & ((1 << bits) - 1))
}

impl Timing {
    /// Returns the timing that `registers`, CR0 to CR18, give.
    pub fn of(registers: &[u8; 25]) -> Self {
        let register = |index: usize| usize::from(registers[index]);
        let bit = |index: usize, bit: u32, place: u32| (register(index) >> bit & 1) << place;
        let blank = register(0x02);
        let retrace = register(0x04);
        let across = AxisTiming {
            total: register(0x00) + 5,
            shown: register(0x01) + 1,
            blank: blank..end(blank, register(0x03) & 0x1F | bit(0x05, 7, 5), 6),
            retrace: retrace..end(retrace, register(0x05), 5),
        };
        // CR7 has bits 8 and 9 of the vertical positions; CR9 has bit 9 of the blank's start.
        let blank = register(0x15) | bit(0x07, 3, 8) | bit(0x09, 5, 9);
        let retrace = register(0x10) | bit(0x07, 2, 8) | bit(0x07, 7, 9);
        let down = AxisTiming {
            total: (register(0x06) | bit(0x07, 0, 8) | bit(0x07, 5, 9)) + 2,
            shown: (register(0x12) | bit(0x07, 1, 8) | bit(0x07, 6, 9)) + 1,
            blank: blank..end(blank, register(0x16), 8),
            retrace: retrace..end(retrace, register(0x11), 4),
        };
        // CR14 bit 6: doublewords; CR17 bit 6: bytes, and words otherwise. CR13 counts pairs of these units.
        let unit = match (bit(0x14, 6, 0), bit(0x17, 6, 0)) {
            (1, _) => 4,
            (_, 1) => 1,
            _ => 2,
        };
        Self {
            across,
            down,
            // CR9 bit 7 doubles each line once more.
            repeat: ((register(0x09) & 0x1F) + 1) << bit(0x09, 7, 0),
            stride: register(0x13) * 2 * unit,
            compare: register(0x18) | bit(0x07, 4, 8) | bit(0x09, 6, 9),
        }
    }

    /// Returns the character clocks of a frame.
    pub fn frame(&self) -> usize {
        self.across.total * self.down.total
    }

    /// Returns each time with the registers that give it, and its unit.
    fn named(&self) -> [(&'static [u8], &'static str, usize, &'static str); 15] {
        let Self { across, down, .. } = self;
        let (clocks, lines) = ("character clocks", "lines");
        [
            (&[0x00], "horizontal total", across.total, clocks),
            (&[0x01], "horizontal display end", across.shown, clocks),
            (
                &[0x02],
                "start of horizontal blank",
                across.blank.start,
                clocks,
            ),
            (
                &[0x02, 0x03, 0x05],
                "end of horizontal blank",
                across.blank.end,
                clocks,
            ),
            (
                &[0x04],
                "start of horizontal retrace",
                across.retrace.start,
                clocks,
            ),
            (
                &[0x04, 0x05],
                "end of horizontal retrace",
                across.retrace.end,
                clocks,
            ),
            (&[0x06, 0x07], "vertical total", down.total, lines),
            (&[0x07, 0x12], "vertical display end", down.shown, lines),
            (
                &[0x07, 0x09, 0x15],
                "start of vertical blank",
                down.blank.start,
                lines,
            ),
            (
                &[0x07, 0x09, 0x15, 0x16],
                "end of vertical blank",
                down.blank.end,
                lines,
            ),
            (
                &[0x07, 0x10],
                "start of vertical retrace",
                down.retrace.start,
                lines,
            ),
            (
                &[0x07, 0x10, 0x11],
                "end of vertical retrace",
                down.retrace.end,
                lines,
            ),
            (&[0x09], "scan lines of each line", self.repeat, lines),
            (
                &[0x13, 0x14, 0x17],
                "offset from line to line",
                self.stride,
                "bytes",
            ),
            (&[0x07, 0x09, 0x18], "line compare", self.compare, lines),
        ]
    }

    /// Reports the times that differ from what a monitor needs: those that register `index` affects, or all.
    pub fn faults(&self, index: Option<u8>) -> impl Iterator<Item = Complaint> {
        let pairs = self.named().into_iter().zip(NEEDED.named());
        let of_index = pairs.filter(move |((registers, ..), _)| {
            index.is_none_or(|index| registers.contains(&index))
        });
        of_index.filter(|(given, needed)| given.2 != needed.2).map(
            |((registers, what, given, unit), (.., needed, _))| {
                let names: Vec<_> = registers.iter().map(|r| format!("CR{r:02X}")).collect();
                let names = names.join(", ");
                let state =
                    format!("{names} {what}: {needed} {unit} needed, the write gives {given}");
                ("wrong timing", state)
            },
        )
    }
}

/// Returns what is wrong with a value of Miscellaneous Output, as far as its bits have an effect.
pub(crate) fn misc_fault(value: u8) -> Option<&'static str> {
    // IBM: a monitor derives the number of lines from the polarity of the syncs. 1 is negative; bit 7 is the
    // vertical sync.
    let lines = [None, Some(400), Some(350), Some(480)][usize::from(value >> 6)];
    [
        (value & 0x01 == 0, "bit 0: the CRTC is not at 3D4h"),
        (
            value & 0x02 == 0,
            "bit 1: the CPU does not reach video memory",
        ),
        (
            value & 0x0C != 0,
            "bits 3 and 2: the dot clock is not 25.175 MHz",
        ),
        (value & 0x10 != 0, "bit 4 is not used, and is 0"),
        (
            value & 0x20 == 0,
            "bit 5: the page of odd/even modes, 1 in each mode of the BIOS",
        ),
        (
            lines != Some(NEEDED.down.shown),
            "bits 7 and 6: the polarity of the syncs is not that of 480 lines",
        ),
    ]
    .into_iter()
    .find_map(|(wrong, why)| wrong.then_some(why))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The dot clock for 00 in Miscellaneous Output bits 3 and 2, in Hz.
    const DOT_CLOCK: f64 = 25_175_000.0;
    /// Dots of a character clock, with SR1 bit 0 set.
    const CHARACTER: f64 = 8.0;

    /// Checks the needed times against the rates that they are derived from.
    #[test]
    fn the_needed_times_make_a_frame() {
        let Timing { across, down, .. } = NEEDED;
        let line_rate = DOT_CLOCK / CHARACTER / across.total as f64;
        assert!((line_rate - 31_469.0).abs() < 0.5, "{line_rate} Hz");
        let frame_rate = line_rate / down.total as f64;
        assert!((frame_rate - 59.71).abs() < 0.005, "{frame_rate} Hz");
        for axis in [&across, &down] {
            // The retrace lies in the blank, outside the displayed part.
            assert!(axis.shown <= axis.blank.start);
            assert!(axis.blank.start < axis.retrace.start);
            assert!(axis.retrace.end < axis.blank.end);
            assert!(axis.blank.end <= axis.total);
        }
        // VESA DMT: a horizontal sync of 96 dots; a vertical sync of 2 lines, 10 lines after the display end.
        assert_eq!(across.retrace.len() * 8, 96);
        assert_eq!(
            (down.retrace.len(), down.retrace.start - down.shown),
            (2, 10)
        );
        // 320x240, 4:3 with square pixels.
        let (width, height) = (across.shown * 8 / 2, down.shown / NEEDED.repeat);
        assert_eq!((width, height), (320, 240));
        assert_eq!(width * 3, height * 4);
        assert_eq!(NEEDED.stride * 4, width);
        assert!(NEEDED.compare > down.total);
    }
}
