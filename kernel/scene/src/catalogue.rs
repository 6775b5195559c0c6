//! The built-in scenes, one file for each: the ball, the knot, the corridor, and the scenes that measure
//! mappers.
//!
//! Each measuring scene tests one property of a mapper. They share the ball's palette and light.

pub(crate) mod ball;
mod corridor;
mod cube;
mod floor;
mod knot;
mod motion;
mod quad;
mod square;
mod surfaces;
mod wall;

pub use crate::entry::{Colours, Entry, MAX_TEXELS, Textures};

impl Entry<'static> {
    /// Returns the built-in scene with this name.
    pub fn parse(name: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|entry| entry.name == name)
    }
}

/// Every built-in scene, the ball first.
pub static CATALOGUE: &[Entry<'static>] = &[
    ball::BALL,
    square::FACING,
    square::TILTED,
    floor::GRAZING_16,
    floor::GRAZING_4096,
    wall::WALL,
    cube::CUBE,
    knot::KNOT,
    corridor::CORRIDOR,
    corridor::MOIRE,
];

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::colour::{RAMPS, Ramp, SHADES};
    use std::boxed::Box;
    use std::collections::{HashMap, HashSet};
    use std::vec::Vec;

    /// Ticks from a whole turn, at irregular intervals.
    const TICKS: [u32; 9] = [0, 1, 89, 180, 271, 360, 447, 540, 719];

    /// Returns the distance of each vertex of a mesh at a tick.
    fn depths(entry: &Entry<'_>, tick: u32) -> Vec<i32> {
        let pose = entry.pose(tick);
        let orientation = pose.orientation();
        let depth = |&vertex| orientation.turn(vertex)[2] + pose.distance;
        entry.mesh.vertices.iter().map(depth).collect()
    }

    #[test]
    fn names_are_plain_and_no_two_alike() {
        let mut known = HashSet::new();
        for entry in CATALOGUE {
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(entry.name.chars().all(plain), "{}", entry.name);
            assert!(known.insert(entry.name), "{}", entry.name);
            assert_eq!(Entry::parse(entry.name).unwrap().name, entry.name);
        }
        assert!(Entry::parse("Ball").is_none());
        assert!(!known.contains(Entry::LOADED));
    }

    /// The scenes that paint a texture which an earlier scene has painted, each with the first of those
    /// scenes; once per texture.
    const SHARED: [(&str, &str); 3] = [
        ("grazing-16", "tilted"),
        ("moire", "corridor"),
        ("moire", "corridor"),
    ];

    #[test]
    fn textures_are_shades_that_light_can_move() {
        let mut texels = Box::new([0; MAX_TEXELS]);
        let mut painted = HashMap::new();
        let mut shared = Vec::new();
        for entry in CATALOGUE {
            for texture in entry.paint(&mut texels).iter() {
                let ramp =
                    |&texel: &u8| usize::from(texel.wrapping_sub(Ramp::Violet.shade(0))) / SHADES;
                let ramps: HashSet<_> = texture.texels().iter().map(ramp).collect();
                assert!(ramps.iter().all(|&ramp| ramp < RAMPS), "{}", entry.name);
                assert!(ramps.len() > 2, "{} is dull", entry.name);
                let first = *painted
                    .entry(texture.texels().to_vec())
                    .or_insert(entry.name);
                if first != entry.name {
                    shared.push((entry.name, first));
                }
            }
        }
        assert_eq!(
            shared, SHARED,
            "SHARED lists the scenes with the same texture; paint another texture or change the list"
        );
    }

    #[test]
    fn floors_have_the_depth_ratios_of_their_names() {
        for (name, ratio) in [("grazing-16", 16), ("grazing-4096", 4096)] {
            let entry = Entry::parse(name).unwrap();
            for tick in TICKS {
                let depths = depths(entry, tick);
                let (near, far) = (depths.iter().min().unwrap(), depths.iter().max().unwrap());
                assert_eq!(near * ratio, *far, "{name} at {tick}");
            }
        }
    }

    #[test]
    fn the_facing_square_has_one_depth() {
        let facing = Entry::parse("facing").unwrap();
        for tick in TICKS {
            let depths = depths(facing, tick);
            assert!(depths.iter().all(|&depth| depth == depths[0]), "{depths:?}");
        }
    }
}
