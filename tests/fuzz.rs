//! Files in any state: whatever a user's model or an image's ramdisk is, it is refused in words or
//! drawn, and nothing panics.
//!
//! Good files are changed at random, so that they come through the first checks and to the later
//! ones. Of a pack the checksum is made to fit again, or nothing behind it would be reached. What is
//! accepted is drawn. A second or so of it is among all tests; `cargo fuzz-models` goes on for two
//! minutes, or as many as `CRYSTAL_BALL_FUZZ_MINUTES` says, from `CRYSTAL_BALL_FUZZ_SEED`.

use std::f64::consts::{PI, TAU};
use std::io::Cursor;
use std::thread;
use std::time::{Duration, Instant};

use crystal_ball::model::{obj, solid, texture};
use fastrand::Rng;
use in_place::InPlace;
use modex::PlanarBuffer;
use pack::{Arena, MAX_BYTES, Pack, Parts};
use scene::catalogue::{Colours, Entry, MAX_TEXELS};
use scene::{MAX_EXTENT, Mesh, Pose, Stage, Storage};
use texmap::{Mapper, Texture};

/// The seed of the tests that are always run.
const SEED: u64 = 6;
/// Where a pack's counts begin, after magic, version, length and checksum.
const COUNTS: usize = 20;

/// Tells the seed of a case that panicked.
struct Case(u64);

impl Drop for Case {
    fn drop(&mut self) {
        if thread::panicking() {
            eprintln!("this was the case of seed {}", self.0);
        }
    }
}

/// What is drawn on, kept from case to case.
struct Room {
    arena: InPlace<Arena>,
    storage: InPlace<Storage>,
    painted: Box<[u8; MAX_TEXELS]>,
    page: Box<PlanarBuffer>,
}

impl Room {
    fn new() -> Self {
        Self {
            arena: in_place::boxed!(Arena),
            storage: in_place::boxed!(Storage),
            painted: Box::new([0; MAX_TEXELS]),
            page: Box::new(PlanarBuffer::new()),
        }
    }

    /// Draws an accepted pack in some pose, by some mapper.
    fn draw(&mut self, pack: &Pack<'_>, random: &mut Rng) {
        let entry = pack.entry(&mut self.arena);
        let textures = entry.paint(&mut self.painted);
        let mut stage = Stage::new(&mut self.storage, entry.scene(&textures));
        stage.set_mapper(Mapper::ALL[random.usize(..Mapper::ALL.len())].1);
        let mut pose = Pose {
            yaw: random.u32(..),
            pitch: random.u32(..),
            roll: random.u32(..),
            distance: random.i32(0..=4 << 16),
        };
        if random.u8(..8) == 0 {
            pose.distance = *random.choice(&[0, 1, Pose::MAX_DISTANCE]).unwrap();
        }
        stage.draw(&pose, &mut *self.page);
    }
}

/// OBJs that are good, each with something of its own.
fn objs() -> Vec<Vec<u8>> {
    let mut ball = String::from("o ball\n");
    let (rings, segments) = (7, 9);
    for ring in 0..=rings {
        for segment in 0..segments {
            let polar = f64::from(ring) / f64::from(rings) * PI;
            let (s, c) = (f64::from(segment) / f64::from(segments) * TAU).sin_cos();
            let (x, y, z) = (polar.sin() * c, polar.cos(), polar.sin() * s);
            ball += &format!("v {x:.4} {y:.4} {z:.4}\n");
            ball += &format!("vt {:.3} {:.3}\n", 3 * segment, 1 - ring);
        }
    }
    for ring in 0..rings {
        for segment in 0..segments {
            let at = |ring: i32, segment: i32| ring * segments + segment % segments + 1;
            let [a, b, c, d] = [
                at(ring, segment + 1),
                at(ring + 1, segment + 1),
                at(ring + 1, segment),
                at(ring, segment),
            ];
            ball += &format!("f {a}/{a} {b}/{b} {c}/{c} {d}/{d}\n");
        }
    }
    let star: String = (0..24)
        .map(|i| {
            let radius = if i % 2 == 0 { 2.0 } else { 0.7 };
            let (s, c) = (f64::from(i) / 24.0 * TAU).sin_cos();
            format!("v {:.4} {:.4} {}\n", radius * c, radius * s, 0.1)
        })
        .collect();
    let rim: String = (1..=24).map(|i| format!(" -{}", 25 - i)).collect();
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n\
                f 5/1/1 6/2/1 7/3/1 8/4/1\ng other\nf 2/1 1/2 4/3 3/4\nusemtl m\n\
                f 1//1 5//1 8//1 4//1\nf 6 2 3 7\nf 4 8 7 3\nf 1 2 6 5\n";
    vec![
        ball.into_bytes(),
        format!("{star}f{rim}\nf \\\n 1 2 3\n").into_bytes(),
        cube.as_bytes().to_vec(),
    ]
}

/// A pack of an OBJ, with a plain texture.
fn packed(text: &[u8], picture: (u32, u32)) -> anyhow::Result<Vec<u8>> {
    let (solid, layout) = solid(&obj::parse(text)?, picture)?;
    let (width, height) = layout.size();
    let texels = layout.cut(|i, j| (i ^ j) as u8);
    let parts = Parts {
        mesh: Mesh {
            vertices: &solid.vertices,
            corners: &solid.corners,
            faces: &solid.faces,
            convex: false,
        },
        texture: Texture::new(&texels, width, height)?,
        colours: Colours::BUILT_IN,
        background: Entry::parse("ball").unwrap().scene(&[]).background,
    };
    let mut bytes = Vec::new();
    parts.write(|part| bytes.extend_from_slice(part));
    Ok(bytes)
}

/// Runs cases of a kind, each from a seed of its own, until `more` says no; returns how many there
/// were, and how many were accepted.
fn run(
    first: u64,
    mut more: impl FnMut(u64) -> bool,
    mut case: impl FnMut(&mut Rng) -> bool,
) -> (u64, u64) {
    let (mut cases, mut accepted) = (0, 0);
    while more(cases) {
        let guard = Case(first + cases);
        accepted += u64::from(case(&mut Rng::with_seed(guard.0)));
        cases += 1;
    }
    (cases, accepted)
}

/// Numbers that are at the border of something, as a pack has them.
fn number(random: &mut Rng) -> i32 {
    let borders = [
        0,
        1,
        -1,
        3,
        11,
        12,
        255 << 16,
        256 << 16,
        (256 << 16) + 1,
        MAX_EXTENT,
        MAX_EXTENT + 1,
        -MAX_EXTENT,
        i32::MAX,
        i32::MIN,
        16_384,
        -16_384,
        4096,
        8192,
    ];
    match random.u8(..3) {
        0 => random.i32(..),
        1 => random.i32(-MAX_EXTENT..=MAX_EXTENT),
        _ => *random.choice(&borders).unwrap(),
    }
}

/// A pack, changed; true if it was accepted all the same.
fn pack_case(good: &[Vec<u8>], room: &mut Room, random: &mut Rng) -> bool {
    let before = random.choice(good).unwrap();
    let mut bytes = before.clone();
    for _ in 0..random.usize(1..6) {
        // Most of a pack is its light table, of which any byte is as good as another.
        let at = match random.u8(..4) {
            0 => random.usize(..COUNTS + 10),
            1 => random.usize(..bytes.len()),
            _ => random.usize(bytes.len() * 2 / 3..bytes.len()),
        };
        // It may have been cut before.
        let at = at.min(bytes.len() - 1);
        match random.u8(..8) {
            0 => bytes[at] ^= 1 << random.u8(..8),
            1 => bytes.truncate(at.max(COUNTS)),
            2 => bytes.extend(std::iter::repeat_with(|| random.u8(..)).take(1 + at % 40)),
            _ => {
                let new = number(random).to_le_bytes();
                let len = new.len().min(bytes.len() - at);
                bytes[at..at + len].copy_from_slice(&new[..len]);
            }
        }
    }
    if bytes != *before {
        assert!(Pack::parse(&bytes).is_err(), "a change went unnoticed");
    }
    if random.u8(..8) > 0 && bytes.len() > COUNTS {
        // Magic and version stand, length and checksum fit.
        bytes[..12].copy_from_slice(&before[..12]);
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[12..16].copy_from_slice(&length);
        let mut checksum = link::Checksum::new();
        checksum.add(&bytes[COUNTS..]);
        bytes[16..20].copy_from_slice(&checksum.value().to_le_bytes());
    }
    match Pack::parse(&bytes) {
        Ok(pack) => {
            room.draw(&pack, random);
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// An OBJ, changed; true if it makes a model all the same, which is then drawn.
fn obj_case(good: &[Vec<u8>], room: &mut Room, random: &mut Rng) -> bool {
    const WORDS: [&str; 30] = [
        "0",
        "-0",
        "1",
        "-1",
        "2",
        "nan",
        "inf",
        "-inf",
        "1e308",
        "1e30",
        "-1e30",
        "1e-320",
        "0.5",
        "99999999999",
        "9223372036854775808",
        "-9223372036854775808",
        "1/",
        "/1",
        "//",
        "1//1",
        "1/2/3/4",
        "-1/-1",
        "f",
        "v",
        "vt",
        "#",
        "\\",
        "\u{e4}",
        "\0",
        "1e9",
    ];
    let text = random.choice(good).unwrap();
    let mut lines: Vec<Vec<u8>> = text.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    for _ in 0..random.usize(1..5) {
        let at = random.usize(..lines.len());
        let other = random.usize(..lines.len());
        match random.u8(..10) {
            0 => lines.swap(at, other),
            1 if lines.len() > 1 => drop(lines.remove(at)),
            2 => lines.insert(at, lines[other].clone()),
            3 => {
                let more = lines[other].clone();
                lines[at].extend_from_slice(&more);
            }
            4 if !lines[at].is_empty() => {
                let byte = random.usize(..lines[at].len());
                lines[at][byte] = random.u8(..);
            }
            _ => {
                let mut words: Vec<_> = lines[at].split(|&b| b == b' ').collect();
                let word = random.usize(..words.len());
                let new = random.choice(&WORDS).unwrap().as_bytes();
                match random.u8(..3) {
                    0 => words.insert(word, new),
                    _ => words[word] = new,
                }
                lines[at] = words.join(&b' ');
            }
        }
    }
    let text = lines.join(&b'\n');
    let picture = *random
        .choice(&[(16, 16), (1, 1), (5, 300), (8192, 1)])
        .unwrap();
    match packed(&text, picture) {
        Ok(bytes) => {
            assert!(bytes.len() <= MAX_BYTES);
            let pack = Pack::parse(&bytes).expect("what is made of an OBJ is a good pack");
            room.draw(&pack, random);
            true
        }
        Err(error) => {
            assert!(!format!("{error:#}").is_empty());
            false
        }
    }
}

/// A PNG, changed; true if it can be read all the same.
fn png_case(good: &[u8], random: &mut Rng) -> bool {
    let mut bytes = good.to_vec();
    for _ in 0..random.usize(1..4) {
        let at = random.usize(..bytes.len());
        match random.u8(..4) {
            0 => bytes.truncate(at.max(1)),
            _ => bytes[at] = random.u8(..),
        }
    }
    match texture::read(Cursor::new(&bytes)) {
        Ok(picture) => {
            let (width, height) = picture.dimensions();
            assert!(width > 0 && height > 0);
            true
        }
        Err(error) => {
            assert!(!format!("{error:#}").is_empty());
            false
        }
    }
}

/// A PNG of some colours.
fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 20, 10);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().unwrap();
    let pixels: Vec<u8> = (0..20 * 10 * 4).map(|i| (i * 7) as u8).collect();
    writer.write_image_data(&pixels).unwrap();
    writer.finish().unwrap();
    bytes
}

/// All three, each as long as its `more` says.
fn all(seed: u64, mut more: impl FnMut(&str, u64) -> bool) {
    let mut room = Room::new();
    let objs = objs();
    let packs: Vec<_> = objs
        .iter()
        .map(|text| packed(text, (16, 16)).unwrap())
        .collect();
    let png = png();
    for bytes in &packs {
        room.draw(&Pack::parse(bytes).unwrap(), &mut Rng::with_seed(seed));
    }
    texture::read(Cursor::new(&png)).unwrap();
    let mut tell = |kind: &str, case: &mut dyn FnMut(&mut Rng) -> bool| {
        let begun = Instant::now();
        let (cases, accepted) = run(seed, |cases| more(kind, cases), case);
        eprintln!(
            "{kind}: {cases} cases from seed {seed}, {accepted} of them accepted, {:.1} s",
            begun.elapsed().as_secs_f64()
        );
        // Fewer, and nothing behind the first checks was reached; more, and nothing was wrong.
        assert!(accepted * 100 > cases && accepted < cases, "{kind}");
    };
    tell("packs", &mut |random| pack_case(&packs, &mut room, random));
    tell("OBJs", &mut |random| obj_case(&objs, &mut room, random));
    tell("PNGs", &mut |random| png_case(&png, random));
}

#[test]
fn nothing_in_any_state_panics() {
    all(SEED, |_, cases| cases < 2000);
}

#[test]
#[ignore = "minutes: cargo fuzz-models"]
fn nothing_in_any_state_panics_for_minutes() {
    let number = |name: &str, default| match std::env::var(name) {
        Ok(text) => text
            .parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {text}")),
        Err(_) => default,
    };
    let minutes: f64 = number("CRYSTAL_BALL_FUZZ_MINUTES", 2.0);
    let seed = number("CRYSTAL_BALL_FUZZ_SEED", 1e6) as u64;
    let mut begun: Option<(String, Instant)> = None;
    all(seed, move |kind, _| {
        let (of, since) = begun.get_or_insert_with(|| (kind.into(), Instant::now()));
        if of != kind {
            (*of, *since) = (kind.into(), Instant::now());
        }
        since.elapsed() < Duration::from_secs_f64(minutes * 20.0)
    });
}
