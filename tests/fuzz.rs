//! Damaged files: every model of a user and every ramdisk of an image is either drawn or refused with a
//! message, and no file causes a panic.
//!
//! Valid files are changed at random, so that they pass the first checks and reach the later ones. The
//! checksums of a model file and of a PNG's chunks are recomputed, because a wrong checksum ends the checks.
//! Every accepted file is drawn. A refusal's message is short and contains no terminal control sequence.
//! `cargo test` does this for about a second. `cargo fuzz-models` does it for two minutes, or
//! `CRYSTAL_BALL_FUZZ_MINUTES`, from the seed `CRYSTAL_BALL_FUZZ_SEED`, or from a fresh seed.

use std::f64::consts::{PI, TAU};
use std::io::Cursor;
use std::thread;
use std::time::{Duration, Instant};

use fastrand::Rng;
use frames::indexed::IndexedImage;
use import::{Model, make_mesh, obj, texture};
use in_place::InPlace;
use model::{Arena, MAX_BYTES, ModelFile, Parts};
use modex::PlanarBuffer;
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::catalogue::{Colours, Entry, MAX_TEXELS};
use scene::{MAX_EXTENT, Mesh, Pose};
use texmap::{Mapper, Texture};

/// The offset of a model file's counts, after magic, version, length and checksum.
const COUNTS: usize = 20;

/// Prints the seed of a case if it panics.
struct SeedReport(u64);

impl Drop for SeedReport {
    fn drop(&mut self) {
        if thread::panicking() {
            eprintln!("the case of seed {} panicked", self.0);
        }
    }
}

/// Memory for drawing, kept from case to case.
struct DrawMemory {
    arena: InPlace<Arena>,
    render_memory: InPlace<RenderMemory>,
    painted: Box<[u8; MAX_TEXELS]>,
    page: Box<PlanarBuffer>,
}

impl DrawMemory {
    fn new() -> Self {
        Self {
            arena: in_place::boxed!(Arena),
            render_memory: in_place::boxed!(RenderMemory),
            painted: Box::new([0; MAX_TEXELS]),
            page: Box::new(PlanarBuffer::new()),
        }
    }

    /// Draws an accepted model file in a random pose, with a random mapper.
    fn draw(&mut self, model_file: &ModelFile<'_>, random: &mut Rng) {
        let entry = model_file.entry(&mut self.arena);
        let textures = entry.paint(&mut self.painted);
        let mut renderer = SceneRenderer::new(&mut self.render_memory, entry.scene(&textures));
        let options = RenderOptions {
            mapper: Mapper::ALL[random.usize(..Mapper::ALL.len())].1,
            ..RenderOptions::default()
        };
        let mut pose = Pose {
            yaw: random.u32(..),
            pitch: random.u32(..),
            roll: random.u32(..),
            distance: random.i32(0..=4 << 16),
        };
        if random.u8(..8) == 0 {
            pose.distance = *random.choice(&[0, 1, Pose::MAX_DISTANCE]).unwrap();
        }
        renderer.draw(&pose, options, &mut *self.page);
    }
}

/// Returns valid OBJs, each with a different feature.
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

/// Returns a model file from an OBJ, with a plain texture.
fn model_file(text: &[u8], image: (u32, u32)) -> anyhow::Result<Vec<u8>> {
    let (mesh, layout) = make_mesh(&obj::parse(text)?, image)?;
    let (width, height) = layout.size();
    let texels = layout.cut(|i, j| (i ^ j) as u8);
    let parts = Parts {
        mesh: Mesh {
            vertices: &mesh.vertices,
            corners: &mesh.corners,
            faces: &mesh.faces,
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

/// Runs cases of a kind, each with a different seed, until `more` returns false. Returns how many cases ran,
/// and how many were accepted.
fn run(
    first: u64,
    mut more: impl FnMut(u64) -> bool,
    mut case: impl FnMut(&mut Rng) -> bool,
) -> (u64, u64) {
    let (mut cases, mut accepted) = (0, 0);
    while more(cases) {
        let guard = SeedReport(first.wrapping_add(cases));
        accepted += u64::from(case(&mut Rng::with_seed(guard.0)));
        cases += 1;
    }
    (cases, accepted)
}

/// Returns numbers at the borders of ranges, in a model file's format.
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

/// Changes a model file; returns whether it was accepted nevertheless.
fn model_file_case(good: &[Vec<u8>], memory: &mut DrawMemory, random: &mut Rng) -> bool {
    let before = random.choice(good).unwrap();
    let mut bytes = before.clone();
    for _ in 0..random.usize(1..6) {
        // Most bytes of a model file are its light table, where any byte is valid.
        let at = match random.u8(..4) {
            0 => random.usize(..COUNTS + 10),
            1 => random.usize(..bytes.len()),
            _ => random.usize(bytes.len() * 2 / 3..bytes.len()),
        };
        // An earlier change may have cut it.
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
        assert!(ModelFile::parse(&bytes).is_err(), "a change went unnoticed");
    }
    if random.u8(..8) > 0 && bytes.len() > COUNTS {
        // Magic and version stay; length and checksum are recomputed.
        bytes[..12].copy_from_slice(&before[..12]);
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[12..16].copy_from_slice(&length);
        let mut checksum = protocol::Checksum::new();
        checksum.add(&bytes[COUNTS..]);
        bytes[16..20].copy_from_slice(&checksum.value().to_le_bytes());
    }
    match ModelFile::parse(&bytes) {
        Ok(model_file) => {
            memory.draw(&model_file, random);
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// Checks that a message may be printed on a terminal.
fn check_message(error: &anyhow::Error) {
    let message = format!("{error:#}");
    assert!(!message.is_empty() && message.len() < 400, "{message:?}");
    assert!(!message.contains(char::is_control), "{message:?}");
}

/// Changes an OBJ; returns whether it makes a model nevertheless, which is then drawn.
fn obj_case(good: &[Vec<u8>], memory: &mut DrawMemory, random: &mut Rng) -> bool {
    const WORDS: [&str; 46] = [
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
        "1.#INF00",
        "1.#QNAN0",
        "-nan(ind)",
        "1,5",
        "0x10",
        "1.0abc",
        "1#",
        "mats\\",
        "vn",
        "t",
        "usemtl",
        "\u{feff}",
        "\u{202e}",
        "\x1b[31m",
        "1/1/0",
        "<",
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
    let text = rewritten(lines.join(&b'\n'), random);
    let image = *random
        .choice(&[(16, 16), (1, 1), (5, 300), (8192, 1)])
        .unwrap();
    if random.u8(..16) == 0 {
        // The whole path, including the messages that name formats.
        return Model::new(&text, None).inspect_err(check_message).is_ok();
    }
    match model_file(&text, image) {
        Ok(bytes) => {
            assert!(bytes.len() <= MAX_BYTES);
            let model_file = ModelFile::parse(&bytes).expect("an OBJ makes a valid model file");
            memory.draw(&model_file, random);
            true
        }
        Err(error) => {
            check_message(&error);
            false
        }
    }
}

/// Rewrites a text in the style of another program: other line ends, other blanks, continued lines, a byte
/// order mark, or the beginning of another format.
fn rewritten(text: Vec<u8>, random: &mut Rng) -> Vec<u8> {
    const BEGINNINGS: [&[u8]; 8] = [
        b"\xef\xbb\xbf",
        b"\xff\xfe",
        b"solid a\n",
        b"ply\n",
        b"<!-- a -->",
        b"\x1b[31m",
        b"\0",
        b"# \\\n",
    ];
    let mut written = Vec::with_capacity(text.len() + 16);
    if random.u8(..8) == 0 {
        written.extend_from_slice(random.choice(&BEGINNINGS).unwrap());
    }
    let style = random.u8(..16);
    for &byte in &text {
        match (byte, style) {
            (b'\n', 0) => written.push(b'\r'),
            (b'\n', 1) => written.extend(b"\r\n"),
            (b'\n', 2) => written.extend_from_slice(*random.choice(&[b"\r", b"\n"]).unwrap()),
            (b' ', 3) => written.push(*random.choice(b" \t\x0b\x0c").unwrap()),
            (b' ', 4) if random.u8(..4) == 0 => written.extend(b" \\ \n"),
            (b' ', 5) if random.u8(..4) == 0 => written.extend(b"\\\t\r"),
            (b'\n', 6) if random.u8(..4) == 0 => written.extend(b"\\\n"),
            _ => written.push(byte),
        }
    }
    written
}

/// Returns a PNG's chunks, each with its kind.
fn chunks(png: &[u8]) -> Vec<(Vec<u8>, Vec<u8>)> {
    let mut rest = &png[8..];
    let mut chunks = Vec::new();
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let (kind, after) = after.split_at(4);
        let (data, after) = after.split_at(u32::from_be_bytes(*length) as usize);
        chunks.push((kind.to_vec(), data.to_vec()));
        rest = &after[4..];
    }
    chunks
}

/// Changes a PNG's chunks and recomputes their checksums; returns whether the PNG can be read nevertheless.
fn chunks_case(good: &[Vec<u8>], random: &mut Rng) -> bool {
    let mut chunks = chunks(random.choice(good).unwrap());
    for _ in 0..random.usize(1..4) {
        let at = random.usize(..chunks.len());
        let other = random.usize(..chunks.len());
        match random.u8(..10) {
            0 => chunks.swap(at, other),
            1 if chunks.len() > 1 => drop(chunks.remove(at)),
            2 => chunks.insert(at, chunks[other].clone()),
            3 => chunks[at].0 = chunks[other].0.clone(),
            4 | 5 => {
                let lengths = [0, 1, 2, 4, 5, 6, 255, 256, 257, 767, 768, 769, 771, 1024];
                let length = *random.choice(&lengths).unwrap();
                chunks[at].1.resize(length, 3);
            }
            6 => {
                let more = random.usize(..5);
                chunks[at].1.resize_with(more, || random.u8(..));
            }
            _ if !chunks[at].1.is_empty() => {
                let data = &mut chunks[at].1;
                let byte = random.usize(..data.len());
                data[byte] = match random.u8(..3) {
                    0 => random.u8(..),
                    1 => random.u8(..8),
                    _ => data[byte] ^ 1 << random.u8(..8),
                };
            }
            _ => {}
        }
    }
    let mut bytes = good[0][..8].to_vec();
    for (kind, data) in chunks {
        bytes.extend((data.len() as u32).to_be_bytes());
        let mut checksum = protocol::Checksum::new();
        for part in [&kind, &data] {
            checksum.add(part);
            bytes.extend_from_slice(part);
        }
        bytes.extend(checksum.value().to_be_bytes());
    }
    is_read(&bytes)
}

/// Changes a PNG's bytes; returns whether it can be read nevertheless.
fn png_case(good: &[Vec<u8>], random: &mut Rng) -> bool {
    let mut bytes = random.choice(good).unwrap().clone();
    for _ in 0..random.usize(1..4) {
        let at = random.usize(..bytes.len());
        match random.u8(..4) {
            0 => bytes.truncate(at.max(1)),
            _ => bytes[at] = random.u8(..),
        }
    }
    is_read(&bytes)
}

/// Returns whether bytes can be read as a texture. Also reads them as `diff` does, which must not panic
/// either.
fn is_read(bytes: &[u8]) -> bool {
    // The program also checks the size in the header first.
    let header = png::Decoder::new(Cursor::new(bytes))
        .read_header_info()
        .map(|header| u64::from(header.width) * u64::from(header.height));
    if header.is_ok_and(|pixels| pixels < 1 << 20) {
        let _ = IndexedImage::read_png(Cursor::new(bytes));
    }
    match texture::read(Cursor::new(bytes)) {
        Ok(image) => {
            let (width, height) = image.pixels.dimensions();
            assert!(width > 0 && height > 0);
            true
        }
        Err(error) => {
            check_message(&error);
            false
        }
    }
}

/// Returns PNGs with a few colours, of all kinds.
fn pngs() -> Vec<Vec<u8>> {
    use png::BitDepth::{Eight, Four, One, Sixteen};
    use png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
    let kinds = [
        (Rgba, Eight),
        (Rgb, Sixteen),
        (Grayscale, One),
        (GrayscaleAlpha, Eight),
        (Indexed, Eight),
        (Indexed, Four),
        (Rgba, Sixteen),
    ];
    let made = |&(colour, depth): &(png::ColorType, png::BitDepth)| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 20, 10);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == Indexed {
            encoder.set_palette((0..48).collect::<Vec<u8>>());
            encoder.set_trns((0..16).map(|i| i * 17).collect::<Vec<u8>>());
        }
        if (colour, depth) == (Rgb, Sixteen) {
            encoder.set_trns(vec![0, 1, 0, 2, 0, 3]);
            encoder.set_animated(1, 0).unwrap();
        }
        let row = (20 * colour.samples() * depth as usize).div_ceil(8);
        let pixels: Vec<u8> = (0..10 * row).map(|i| (i % 16) as u8).collect();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&pixels).unwrap();
        writer.finish().unwrap();
        bytes
    };
    kinds.iter().map(made).collect()
}

/// Runs all kinds, each until its `more` returns false.
fn all(seed: u64, mut more: impl FnMut(&str, u64) -> bool) {
    let mut memory = DrawMemory::new();
    let objs = objs();
    let model_files: Vec<_> = objs
        .iter()
        .map(|text| model_file(text, (16, 16)).unwrap())
        .collect();
    let pngs = pngs();
    for bytes in &model_files {
        memory.draw(&ModelFile::parse(bytes).unwrap(), &mut Rng::with_seed(seed));
    }
    for png in &pngs {
        texture::read(Cursor::new(png)).unwrap();
    }
    let mut report = |kind: &str, case: &mut dyn FnMut(&mut Rng) -> bool| {
        let begun = Instant::now();
        let (cases, accepted) = run(seed, |cases| more(kind, cases), case);
        eprintln!(
            "{kind}: {cases} cases from seed {seed}, {accepted} of them accepted, {:.1} s",
            begun.elapsed().as_secs_f64()
        );
        // If fewer cases were accepted, nothing behind the first checks was reached; if all were, nothing was
        // wrong. In practice at least a twentieth of each kind is accepted; the limit is a hundredth, because
        // the cases of a short run may all be similar.
        let some = accepted * 100 > cases && accepted < cases;
        assert!(some || cases < 1000, "{kind}");
    };
    report("model files", &mut |random| {
        model_file_case(&model_files, &mut memory, random)
    });
    report("OBJs", &mut |random| obj_case(&objs, &mut memory, random));
    report("PNGs", &mut |random| png_case(&pngs, random));
    report("PNGs' chunks", &mut |random| chunks_case(&pngs, random));
}

#[test]
fn no_damaged_file_causes_a_panic() {
    let (seed, most) = (seeded::generator().get_seed(), seeded::cases(2000) as u64);
    all(seed, |_, cases| cases < most);
}

#[test]
#[ignore = "minutes: cargo fuzz-models"]
fn no_damaged_file_causes_a_panic_for_minutes() {
    let number = |name: &str, default| match std::env::var(name) {
        Ok(text) => text
            .parse()
            .unwrap_or_else(|_| panic!("{name}: '{text}' is not a number")),
        Err(_) => default,
    };
    let minutes: f64 = number("CRYSTAL_BALL_FUZZ_MINUTES", 2.0);
    // Small enough that an `f64` is exact.
    let fresh = fastrand::u64(..1 << 48);
    let seed = number("CRYSTAL_BALL_FUZZ_SEED", fresh as f64) as u64;
    let mut begun: Option<(String, Instant)> = None;
    all(seed, move |kind, _| {
        let (of, since) = begun.get_or_insert_with(|| (kind.into(), Instant::now()));
        if of != kind {
            (*of, *since) = (kind.into(), Instant::now());
        }
        since.elapsed() < Duration::from_secs_f64(minutes * 15.0)
    });
}
