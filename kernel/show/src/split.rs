//! The split view: one picture three times, as the set mapper draws it, exact, and its error.
//!
//! Each window shows the same 104 columns from the middle of the picture. They are a multiple of four
//! columns apart, so each of the picture's columns keeps its plane, and no mapper knows of it.
//!
//! The error is a heat map: black and blue are fractions of a texel that no one sees, teal is up to a
//! texel, gold some texels, rose and white what is far off.

use core::ops::Range;

use modex::{Destination, HEIGHT, Palette, Rgb6, WIDTH, Window};
use scene::{Pose, Stage};
use texmap::{Mapper, Stats};

use crate::palette::nearest;

/// The columns of the picture that are shown.
const COLUMNS: Range<u16> = 108..212;
/// Where each window begins.
pub(crate) const WINDOWS: [usize; 3] = [0, 108, 216];
/// Columns of a window.
const WINDOW: usize = COLUMNS.end as usize - COLUMNS.start as usize;
const _: () = assert!(WINDOWS[2] + WINDOW == WIDTH);

/// Steps of the heat map: below 1/256 texel, then a step each time the error doubles, and 64 texels
/// and more.
pub(crate) const STEPS: usize = 16;
/// The step at which a texel is reached.
pub(crate) const TEXEL: usize = 9;
/// 1/256 texel, in 2^-16 texel, as a power of two.
const FIRST: u32 = 8;

/// Columns of a step in the legend, lines of it, and where it is.
pub(crate) const LEGEND_STEP: usize = 6;
pub(crate) const LEGEND_LINES: usize = 5;
pub(crate) const LEGEND_X: usize = WINDOWS[2] + (WINDOW - STEPS * LEGEND_STEP) / 2;
pub(crate) const LEGEND_Y: usize = HEIGHT - 29;

/// The heat map's colours. A palette that has them shows the steps apart.
#[rustfmt::skip]
pub const HEAT: [Rgb6; STEPS] = [
    [ 1,  1,  7], [ 3,  4, 17], [ 6,  7, 26], [10, 13, 37], [15, 19, 48], // to 1/16
    [ 8, 27, 49], [ 5, 34, 39], [15, 44, 46], [26, 54, 53], // to 1
    [46, 28,  8], [55, 40, 14], [62, 51, 20], // to 8
    [48, 11, 36], [61, 35, 47], [63, 58, 60], [63, 63, 63],
];

/// The heat map's step of an error in 2^-16 texel.
fn step(error: u32) -> usize {
    let log = error.checked_ilog2().unwrap_or(0);
    (log + 1).saturating_sub(FIRST).min(STEPS as u32 - 1) as usize
}

/// Colours of the heat map in a palette.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    heat: [u8; STEPS],
    black: u8,
}

impl Split {
    /// Those of a palette, whatever it holds.
    pub fn of(palette: &Palette) -> Self {
        Self {
            heat: HEAT.map(|colour| nearest(palette, colour)),
            black: nearest(palette, [0; 3]),
        }
    }

    /// Draws the three windows. Returns what the first one took, and the largest error in the last,
    /// in 2^-16 texel.
    pub fn draw(
        &self,
        stage: &mut Stage<'_>,
        pose: &Pose,
        destination: &mut impl Destination,
    ) -> (Stats, u32) {
        let [left, middle, right] = WINDOWS.map(|x| x as u16);
        let (mapper, lower) = (stage.mapper(), stage.lower_for(None));
        stage.set_mapper(Mapper::Exact);
        stage.draw(pose, &mut Window::new(destination, COLUMNS, middle));
        stage.set_mapper(mapper);
        stage.lower_for(lower);
        let colour = |error| self.heat[step(error)];
        let mut window = Window::new(destination, COLUMNS, right);
        let most = stage.draw_errors(pose, COLUMNS, colour, &mut window);
        let stats = stage.draw(pose, &mut Window::new(destination, COLUMNS, left));
        (stats, most)
    }

    /// Draws what is between the windows, and the heat map's legend.
    pub fn draw_frame(&self, destination: &mut impl Destination) {
        let (left, top) = (LEGEND_X, LEGEND_Y);
        for plane in 0..4 {
            destination.select(plane as u16);
            for window in &WINDOWS[1..] {
                let x = window - 4 + plane;
                destination.lane::<{ modex::STRIDE }>(x as u16, 0, HEIGHT as u16, |column| {
                    column.fill(|| self.black);
                });
            }
            let columns = left..left + STEPS * LEGEND_STEP;
            for x in columns.filter(|x| x % 4 == plane) {
                let colour = self.heat[(x - left) / LEGEND_STEP];
                let (x, y, lines) = (x as u16, top as u16, LEGEND_LINES as u16);
                destination.lane::<{ modex::STRIDE }>(x, y, lines, |column| {
                    column.fill(|| colour);
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_begins_where_an_error_has_doubled() {
        assert_eq!([0, 1, 255].map(step), [0; 3]);
        for (i, log) in (FIRST..FIRST + 15).enumerate() {
            let error = 1 << log;
            assert_eq!((step(error - 1), step(error)), (i, i + 1));
        }
        assert_eq!(step(1 << 16), TEXEL);
        assert_eq!(step(u32::MAX), STEPS - 1);
    }

    #[test]
    fn heat_has_a_colour_for_every_step_in_the_built_in_palette() {
        let palette = scene::catalogue::CATALOGUE[0].scene(&[]).palette;
        let heat = Split::of(palette).heat;
        for (i, a) in heat.iter().enumerate() {
            assert!(!heat[..i].contains(a), "step {i}");
        }
    }
}
