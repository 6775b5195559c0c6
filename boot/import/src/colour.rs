//! A model's palette, light table and texels.
//!
//! Two reductions, each by a quantizer that works in a space of even steps to the eye (Oklab). The
//! texture is reduced to `MATERIALS` colours. Then each of these is lit in all levels, from night
//! to glint, as the built-in ramps are; and what that gives is reduced to the part of the palette
//! that background, writing and the split view's heat map leave free. The light table takes each
//! material at each level to the nearest entry of the whole palette.
//!
//! Where the palette has no colour near enough, a surface would fall into bands. So a texel has not
//! its material alone: by its place in a square of two by two it is one of `VARIANTS`, and for
//! each level the entries of the four are chosen one after the other, each to make good for what the
//! ones before it were off. Together they have the colour that was meant.

use std::collections::BTreeSet;

use image::Rgb;
use modex::{Palette, Rgb6};
use quantette::color_space::srgb8_to_oklab;
use quantette::deps::palette::{Oklab, Srgb};
use quantette::{Pipeline, QuantizeMethod};
use scene::catalogue::Colours;
use scene::{AMBIENT, FULL_LIGHT, LIGHT_LEVELS, LightTable};
use show::HEAT;
use vga::widen;

/// Texels of one material: two by two.
const VARIANTS: usize = 4;
/// Colours of the texture.
const MATERIALS: usize = 256 / VARIANTS;
/// Which of the variants a texel is, by whether its column is odd, and its row: what is brightest
/// and what is darkest lie on a diagonal.
const PATTERN: [[usize; 2]; 2] = [[0, 2], [3, 1]];
/// What the built-in ramps begin in, widened: what is turned from the lamp is lit by the night sky.
const NIGHT: [f64; 3] = [8.0, 5.0, 28.0];
/// The lamp's own colour, which a highlight goes to.
const LAMP: [f64; 3] = [255.0, 253.0, 244.0];
/// The way to the lamp's colour that the brightest highlight goes.
const GLINT: f64 = 0.4;

/// The part of an error that is made good for. With all of it a small one would add up until one
/// texel of the four has another hue altogether, which is seen more than the error.
const MADE_GOOD: f32 = 0.6;
/// How much more the most frequent material weighs than one that hardly occurs.
const MOST_WEIGHT: f64 = 32.0;

/// What a texture is reduced to.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// Which material and which variant, row by row.
    pub texels: Vec<u8>,
    /// The DAC's colours.
    pub palette: Palette,
    /// The entry of each texel's value at each level.
    pub light: LightTable,
}

/// Reduces a texture of so many columns.
pub fn reduce(texture: &[Rgb<u8>], columns: usize) -> Reduced {
    let colours: Vec<_> = texture
        .iter()
        .map(|&Rgb(parts)| Srgb::from(parts))
        .collect();
    let materials = quantized(&colours, MATERIALS);
    let of_materials = srgb8_to_oklab(&materials);
    let nearest_material = Nearest::new(of_materials);
    let colours = srgb8_to_oklab(&colours);
    let mut used = vec![0; materials.len()];
    let texels: Vec<_> = colours
        .iter()
        .enumerate()
        .map(|(i, colour)| {
            let material = nearest_material.to(*colour);
            used[material] += 1;
            let variant = PATTERN[i / columns % 2][i % columns % 2];
            (material * VARIANTS + variant) as u8
        })
        .collect();

    let lit: Vec<Vec<Srgb<u8>>> = (0..LIGHT_LEVELS)
        .map(|level| materials.iter().map(|&colour| lit(colour, level)).collect())
        .collect();
    let mut palette = *Colours::BUILT_IN.palette;
    let (own, heat) = palette[scene::MATERIALS].split_at_mut(scene::MATERIALS.len() - HEAT.len());
    heat.copy_from_slice(&HEAT);
    let colours = quantized(&weighted(&lit, &used), own.len());
    for (entry, colour) in own.iter_mut().zip(colours) {
        *entry = narrow(colour);
    }
    let shown: Vec<_> = palette
        .iter()
        .map(|colour| Srgb::from(colour.map(widen)))
        .collect();
    let nearest_entry = Nearest::new(srgb8_to_oklab(&shown));
    let mut light = [[0; 256]; LIGHT_LEVELS];
    for (row, lit) in light.iter_mut().zip(lit) {
        for (entries, target) in row.chunks_exact_mut(VARIANTS).zip(srgb8_to_oklab(&lit)) {
            let mut wanted = target;
            let mut chosen = [0; VARIANTS].map(|_: u8| {
                let entry = nearest_entry.to(wanted);
                wanted += (target - nearest_entry.colours[entry]) * MADE_GOOD;
                entry
            });
            let lightness = |&entry: &usize| nearest_entry.colours[entry].l;
            chosen.sort_by(|a, b| lightness(a).total_cmp(&lightness(b)));
            for (entry, chosen) in entries.iter_mut().zip(chosen) {
                *entry = chosen as u8;
            }
        }
    }
    Reduced {
        texels,
        palette,
        light,
    }
}

/// The lit colours, those more often of which there is more, by the square root: a large field is
/// smooth then, and an eye in it still has its colour.
fn weighted(lit: &[Vec<Srgb<u8>>], used: &[u32]) -> Vec<Srgb<u8>> {
    let most = used.iter().copied().max().unwrap_or(1);
    let times = |used: u32| 1 + (MOST_WEIGHT * (f64::from(used) / f64::from(most)).sqrt()) as usize;
    let mut weighted = Vec::new();
    for level in lit {
        for (&colour, &used) in level.iter().zip(used) {
            weighted.extend(std::iter::repeat_n(colour, times(used)));
        }
    }
    weighted
}

/// At most `count` colours for all of these: they themselves, if there are no more.
fn quantized(colours: &[Srgb<u8>], count: usize) -> Vec<Srgb<u8>> {
    let parts = colours.iter().map(|&colour| <[u8; 3]>::from(colour));
    let different: BTreeSet<_> = parts.collect();
    if different.len() <= count {
        return different.into_iter().map(Srgb::from).collect();
    }
    let size = count.try_into().expect("a palette has at most 256 colours");
    let pipeline = Pipeline::new()
        .palette_size(size)
        .quantize_method(QuantizeMethod::kmeans());
    let input = pipeline
        .input_slice(colours)
        .expect("there are some, and not too many");
    input.output_srgb8_palette().into_vec()
}

/// A colour in the light of a level, in steps that look even, as the ramps are.
fn lit(colour: Srgb<u8>, level: usize) -> Srgb<u8> {
    let full = (FULL_LIGHT + AMBIENT) as f64;
    let diffuse = (level.min(FULL_LIGHT) + AMBIENT) as f64 / full;
    let glint =
        GLINT * level.saturating_sub(FULL_LIGHT) as f64 / (LIGHT_LEVELS - 1 - FULL_LIGHT) as f64;
    let parts = [colour.red, colour.green, colour.blue].map(f64::from);
    let blend = |from: f64, to: f64, part: f64| from + (to - from) * part;
    Srgb::from([0, 1, 2].map(|k| {
        let dim = blend(NIGHT[k].min(parts[k]), parts[k], diffuse);
        blend(dim, LAMP[k], glint).round() as u8
    }))
}

/// Eight bits of each part as the DAC's six, rounded.
fn narrow(colour: Srgb<u8>) -> Rgb6 {
    [colour.red, colour.green, colour.blue].map(|part| ((u16::from(part) * 63 + 127) / 255) as u8)
}

/// Looks colours up.
struct Nearest {
    colours: Vec<Oklab>,
}

impl Nearest {
    fn new(colours: Vec<Oklab>) -> Self {
        Self { colours }
    }

    /// The number of the nearest one; of several the first.
    fn to(&self, colour: Oklab) -> usize {
        let distance = |other: &Oklab| {
            let off = *other - colour;
            off.l * off.l + off.a * off.a + off.b * off.b
        };
        let distances = self.colours.iter().map(distance).enumerate();
        let nearest = distances.min_by(|(_, a), (_, b)| a.total_cmp(b));
        nearest.map_or(0, |(i, _)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A texture of 64 x 64 with a sweep of hues, a flat field and one odd texel.
    fn texture() -> Vec<Rgb<u8>> {
        let mut texture: Vec<_> = (0..64 * 64u32)
            .map(|i| match (i % 64, i / 64) {
                (x, y @ 0..32) => Rgb([(x * 4) as u8, (y * 8) as u8, 255 - (x * 4) as u8]),
                _ => Rgb([230, 200, 20]),
            })
            .collect();
        texture[64 * 50 + 30] = Rgb([0, 0, 0]);
        texture
    }

    #[test]
    fn four_texels_together_have_their_colour_in_full_light() {
        let texture = texture();
        let reduced = reduce(&texture, 64);
        let shown = |x: usize, y: usize| {
            let entry = reduced.light[FULL_LIGHT][usize::from(reduced.texels[64 * y + x])];
            reduced.palette[usize::from(entry)].map(|part| i32::from(widen(part)))
        };
        let (mut worst, mut sum) = (0, 0);
        for y in (0..64).step_by(2) {
            for x in (0..64).step_by(2) {
                let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                for k in 0..3 {
                    let meant: i32 = four
                        .map(|(x, y)| i32::from(texture[64 * y + x].0[k]))
                        .iter()
                        .sum();
                    let is: i32 = four.map(|(x, y)| shown(x, y)[k]).iter().sum();
                    let off = (meant - is).abs() / 4;
                    (worst, sum) = (worst.max(off), sum + off);
                }
            }
        }
        // As seen by the eye; a channel alone may be off by more.
        let mean = sum / (3 * 32 * 32);
        assert!(mean < 12 && worst < 96, "{mean}, at most {worst}, of 255");
        let black = shown(30, 50);
        assert!(black.iter().all(|&part| part < 40), "{black:?}");
    }

    #[test]
    fn light_brightens_and_what_is_not_the_models_stays() {
        let reduced = reduce(&texture(), 64);
        let built_in = Colours::BUILT_IN.palette;
        for entry in (0..256).filter(|entry| !scene::MATERIALS.contains(entry)) {
            assert_eq!(reduced.palette[entry], built_in[entry]);
        }
        for step in HEAT {
            assert!(reduced.palette.contains(&step), "{step:?}");
        }
        let brightness = |level: usize| -> u32 {
            let entries = reduced
                .texels
                .iter()
                .map(|&texel| reduced.light[level][usize::from(texel)]);
            let parts = entries.map(|entry| reduced.palette[usize::from(entry)].map(u32::from));
            parts.map(|[r, g, b]| 3 * r + 6 * g + b).sum()
        };
        for level in 1..LIGHT_LEVELS {
            assert!(brightness(level) > brightness(level - 1), "{level}");
        }
    }

    #[test]
    fn one_colour_is_a_texture_too_and_the_same_comes_out_again() {
        let plain = [Rgb([10, 200, 30])];
        let reduced = reduce(&plain, 1);
        let entry = reduced.light[FULL_LIGHT][usize::from(reduced.texels[0])];
        assert_eq!(reduced.palette[usize::from(entry)], [2, 49, 7]);
        let (once, again) = (reduce(&texture(), 64), reduce(&texture(), 64));
        assert_eq!((once.texels, once.palette), (again.texels, again.palette));
        assert_eq!(once.light, again.light);
    }
}
