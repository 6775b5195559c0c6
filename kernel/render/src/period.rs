//! The period of a texture: how far it may move until it looks the same again.
//!
//! In a pattern of many periods the finest matter. The period here is that of the root mean square frequency
//! along u or v, whichever is shorter. For a single wave this is the period of the wave. Let d be the mean
//! square difference between a texel and the next, and s the mean square difference between a texel and the
//! mean. A wave of w radians a texel has d / s = 4 sin^2(w / 2), and half its period is pi / w texels.

use modex::Palette;
use scene::trig::sin;
use texmap::Texture;

/// Returns half the period of a texture's root mean square frequency, 16.16 texels, at least 1, or `None` for
/// a texture of one colour.
pub(crate) fn half_period(texture: &Texture<'_>, palette: &Palette) -> Option<u32> {
    let sides = texture
        .tile()
        .unwrap_or((texture.width(), texture.height()));
    let (width, height) = (usize::from(sides.0), usize::from(sides.1));
    // Luma: the usual weights in sixteenths.
    let luma = palette.map(|[r, g, b]| 5 * i64::from(r) + 9 * i64::from(g) + 2 * i64::from(b));
    let pitch = usize::from(texture.pitch());
    let at = |i: usize, j: usize| luma[usize::from(texture.texels()[j * pitch + i])];
    // Every scene passes through here before its first frame, so the loop does no division per texel.
    let after = |i: usize, side: usize| if i + 1 == side { 0 } else { i + 1 };
    let (mut sum, mut squares, mut across, mut down) = (0, 0, 0, 0);
    for j in 0..height {
        for i in 0..width {
            let here = at(i, j);
            sum += here;
            squares += here * here;
            across += (at(after(i, width), j) - here).pow(2);
            down += (at(i, after(j, height)) - here).pow(2);
        }
    }
    // At most 65 536 texels with a luma below 2^10: the square of the sum is below 2^52 and fits.
    let texels = (width * height) as i64;
    let spread = squares - sum * sum / texels;
    let differences = across.max(down);
    if spread == 0 || differences == 0 {
        return None;
    }
    // sin^2(w / 2), 60 fraction bits.
    let ratio = ((i128::from(differences) << 60) / (4 * i128::from(spread))).min(1 << 60);
    // w / 2 as a fraction of a turn, from the top bit down; at most a quarter.
    let mut angle = 0u32;
    for bit in (0..30).rev() {
        let next = angle | 1 << bit;
        if i128::from(sin(next)).pow(2) <= ratio {
            angle = next;
        }
    }
    // pi / w: a quarter turn over w / 2.
    Some(((1u64 << 46) / u64::from(angle.max(1))).min(1 << 31) as u32)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// A grey ramp.
    fn greys() -> Palette {
        core::array::from_fn(|i| [i as u8 / 4; 3])
    }

    /// Half the period of a texture whose texels have a brightness of 0 to 255.
    fn half_period_of(side: u16, texel: impl Fn(f64, f64) -> f64) -> Option<f64> {
        let places = (0..side).flat_map(|j| (0..side).map(move |i| (i, j)));
        let texels: Vec<u8> = places
            .map(|(i, j)| texel(i.into(), j.into()).round() as u8)
            .collect();
        let texture = Texture::new(&texels, side, side).unwrap();
        half_period(&texture, &greys()).map(|half| f64::from(half) / 65_536.0)
    }

    #[test]
    fn a_wave_has_its_own_period_and_of_two_the_shorter_counts_more() {
        let wave = |x: f64, period: f64| 60.0 * (core::f64::consts::TAU * x / period).sin();
        for period in [2.5, 4.0, 8.0, 16.0, 32.0] {
            let side = 160;
            for along in [true, false] {
                let half =
                    half_period_of(side, |i, j| 128.0 + wave(if along { i } else { j }, period));
                let half = half.unwrap();
                assert!(
                    (half - period / 2.0).abs() < period / 40.0,
                    "{period}: {half}"
                );
            }
        }
        let stripes = half_period_of(64, |i, _| if i % 2.0 == 0.0 { 40.0 } else { 200.0 });
        assert_eq!(stripes, Some(1.0));
        let mixed = half_period_of(160, |i, _| 128.0 + wave(i, 8.0) + wave(i, 40.0)).unwrap();
        assert!((4.0..8.0).contains(&mixed), "{mixed}");
        assert_eq!(half_period_of(64, |_, _| 77.0), None);
    }
}
