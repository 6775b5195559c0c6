//! A model's palette, light table and texels.
//!
//! There are two reductions, each by a quantizer that works in Oklab, a colour space in which equal steps
//! look equal. The first reduces the texture to `MATERIALS` colours. Each of these colours is then lit at
//! all levels, from night to glint, as the built-in ramps are. The second reduces the lit colours to the
//! part of the palette that the background, the overlay's text and the split view's heat map leave free. The
//! light table maps each material at each level to the nearest entry of the whole palette.
//!
//! Where the palette has no colour near enough, a surface would fall into bands. So a texel holds more than
//! its material: by its place in a square of two by two, it is one of `VARIANTS` variants. For each level,
//! the entries of the four variants are chosen in turn, and each choice corrects the error of the choices
//! before it. Together the four have the intended colour.

use std::collections::BTreeSet;

use demo::HEAT;
use image::Rgb;
use modex::{Palette, Rgb6};
use quantette::color_space::srgb8_to_oklab;
use quantette::deps::palette::{Oklab, Srgb};
use quantette::{Pipeline, QuantizeMethod};
use scene::catalogue::Colours;
use scene::{AMBIENT, FULL_LIGHT, LIGHT_LEVELS, LightTable};
use vga::widen;

/// The number of variants of a material: one for each texel of a square of two by two.
const VARIANTS: usize = 4;
/// The number of colours of the texture.
const MATERIALS: usize = 256 / VARIANTS;
/// The variant of a texel, by whether its row is odd and whether its column is odd. The two darker variants
/// lie on one diagonal, the two brighter on the other.
const PATTERN: [[usize; 2]; 2] = [[0, 2], [3, 1]];
/// The first colour of the built-in ramps, with 8 bits a component: the night sky lights surfaces that face
/// away from the lamp.
const NIGHT: [f64; 3] = [8.0, 5.0, 28.0];
/// The lamp's colour, which a highlight approaches.
const LAMP: [f64; 3] = [255.0, 253.0, 244.0];
/// The part of the way to the lamp's colour that the brightest highlight goes.
const GLINT: f64 = 0.4;

/// The part of the error that the next variant corrects. With a part of 1, a small error would add up until
/// one texel of the four has a different hue, which is more visible than the error.
const CORRECTED_PART: f32 = 0.6;
/// The additional weight of the most frequent material, compared with a material that hardly occurs.
const MAX_WEIGHT: f64 = 32.0;

/// A texture with a limited number of colours, its palette and its light table.
#[derive(Clone, Debug)]
pub struct QuantizedTexture {
    /// The material and the variant of each texel, row by row.
    pub texels: Vec<u8>,
    /// The DAC's colours.
    pub palette: Palette,
    /// For each light level, the palette entry of each texel value.
    pub light: LightTable,
}

/// Quantises a texture with this number of columns.
pub fn quantize(texture: &[Rgb<u8>], columns: usize) -> QuantizedTexture {
    let colours: Vec<_> = texture
        .iter()
        .map(|&Rgb(parts)| Srgb::from(parts))
        .collect();
    let materials = quantized(&colours, MATERIALS);
    let of_materials = srgb8_to_oklab(&materials);
    let nearest_material = NearestColour::new(of_materials);
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
    let nearest_entry = NearestColour::new(srgb8_to_oklab(&shown));
    let mut light = [[0; 256]; LIGHT_LEVELS];
    for (row, lit) in light.iter_mut().zip(lit) {
        for (entries, target) in row.chunks_exact_mut(VARIANTS).zip(srgb8_to_oklab(&lit)) {
            let mut corrected = target;
            let mut chosen = [0; VARIANTS].map(|_: u8| {
                let entry = nearest_entry.to(corrected);
                corrected += (target - nearest_entry.colours[entry]) * CORRECTED_PART;
                entry
            });
            let lightness = |&entry: &usize| nearest_entry.colours[entry].l;
            chosen.sort_by(|a, b| lightness(a).total_cmp(&lightness(b)));
            for (entry, chosen) in entries.iter_mut().zip(chosen) {
                *entry = chosen as u8;
            }
        }
    }
    QuantizedTexture {
        texels,
        palette,
        light,
    }
}

/// Returns the lit colours, each repeated by the square root of its frequency. So a large area is smooth,
/// and a small detail, such as an eye in it, keeps its colour.
fn weighted(lit: &[Vec<Srgb<u8>>], used: &[u32]) -> Vec<Srgb<u8>> {
    let most = used.iter().copied().max().unwrap_or(1);
    let times = |used: u32| 1 + (MAX_WEIGHT * (f64::from(used) / f64::from(most)).sqrt()) as usize;
    let mut weighted = Vec::new();
    for level in lit {
        for (&colour, &used) in level.iter().zip(used) {
            weighted.extend(std::iter::repeat_n(colour, times(used)));
        }
    }
    weighted
}

/// Returns at most `count` colours that represent the given colours: the colours themselves, if there are no
/// more than `count`.
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
        .expect("a texture has 1 to 65 536 colours");
    input.output_srgb8_palette().into_vec()
}

/// Returns a colour at a light level. The steps between levels look even, as in the built-in ramps.
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

/// Rounds a colour from 8 bits a component to the DAC's 6.
fn narrow(colour: Srgb<u8>) -> Rgb6 {
    [colour.red, colour.green, colour.blue].map(|part| ((u16::from(part) * 63 + 127) / 255) as u8)
}

/// Finds the nearest of some colours.
struct NearestColour {
    colours: Vec<Oklab>,
}

impl NearestColour {
    fn new(colours: Vec<Oklab>) -> Self {
        Self { colours }
    }

    /// Returns the index of the nearest colour, or the first index if several are equally near.
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

    /// Returns a texture of 64 x 64 with a range of hues, a flat area and one odd texel.
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
    fn four_neighbouring_texels_average_to_the_intended_colour() {
        let texture = texture();
        let result = quantize(&texture, 64);
        let shown = |x: usize, y: usize| {
            let entry = result.light[FULL_LIGHT][usize::from(result.texels[64 * y + x])];
            result.palette[usize::from(entry)].map(|part| i32::from(widen(part)))
        };
        let (mut worst, mut sum) = (0, 0);
        for y in (0..64).step_by(2) {
            for x in (0..64).step_by(2) {
                let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                for k in 0..3 {
                    let intended: i32 = four
                        .map(|(x, y)| i32::from(texture[64 * y + x].0[k]))
                        .iter()
                        .sum();
                    let drawn: i32 = four.map(|(x, y)| shown(x, y)[k]).iter().sum();
                    let off = (intended - drawn).abs() / 4;
                    (worst, sum) = (worst.max(off), sum + off);
                }
            }
        }
        // The bounds are wide, because the error is small as the eye sees it, and a single channel can be
        // further off.
        let mean = sum / (3 * 32 * 32);
        assert!(mean < 12 && worst < 96, "{mean}, at most {worst}, of 255");
        let black = shown(30, 50);
        assert!(black.iter().all(|&part| part < 40), "{black:?}");
    }

    #[test]
    fn light_levels_brighten_and_reserved_palette_entries_stay() {
        let result = quantize(&texture(), 64);
        let built_in = Colours::BUILT_IN.palette;
        for entry in (0..256).filter(|entry| !scene::MATERIALS.contains(entry)) {
            assert_eq!(result.palette[entry], built_in[entry]);
        }
        for step in HEAT {
            assert!(result.palette.contains(&step), "{step:?}");
        }
        let brightness = |level: usize| -> u32 {
            let entries = result
                .texels
                .iter()
                .map(|&texel| result.light[level][usize::from(texel)]);
            let parts = entries.map(|entry| result.palette[usize::from(entry)].map(u32::from));
            parts.map(|[r, g, b]| 3 * r + 6 * g + b).sum()
        };
        for level in 1..LIGHT_LEVELS {
            assert!(brightness(level) > brightness(level - 1), "{level}");
        }
    }

    #[test]
    fn a_single_colour_is_a_valid_texture_and_the_result_is_deterministic() {
        let plain = [Rgb([10, 200, 30])];
        let result = quantize(&plain, 1);
        let entry = result.light[FULL_LIGHT][usize::from(result.texels[0])];
        assert_eq!(result.palette[usize::from(entry)], [2, 49, 7]);
        let (once, again) = (quantize(&texture(), 64), quantize(&texture(), 64));
        assert_eq!((once.texels, once.palette), (again.texels, again.palette));
        assert_eq!(once.light, again.light);
    }
}
