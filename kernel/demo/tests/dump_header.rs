//! Properties of dump headers after any sequence of commands: the header is enough to draw the dump again,
//! and after `hold` nothing depends on earlier commands.

mod asked;

use asked::{ask, done, memory};
use demo::Show;
use fastrand::Rng;
use protocol::Action;
use scene::catalogue::CATALOGUE;
use texmap::{Mapper, Order};
use vga::Vga;

/// Commands in a sequence.
const COMMANDS: usize = 60;
const REPEATED: u32 = 5;

fn choice<T: Copy>(random: &mut Rng, all: &[T]) -> T {
    all[random.usize(..all.len())]
}

/// Returns `scene`, `mapper` or `order`, and a name.
fn setting(random: &mut Rng) -> String {
    match random.u8(..4) {
        0 => {
            let scene = &CATALOGUE[random.usize(..CATALOGUE.len())];
            format!("scene {}", scene.name)
        }
        1 => format!("order {}", choice(random, &Order::ALL).0),
        // Mappers that reduced quality affects are chosen more often.
        2 => format!("mapper {}", choice(random, &["exact", "within-1/4"])),
        _ => format!("mapper {}", choice(random, Mapper::ALL).0),
    }
}

/// Returns four hex numbers: three below 2^`bits` in absolute value, and `distance`.
fn turn(random: &mut Rng, bits: u32, distance: u32) -> String {
    let mut part = || {
        let value = random.u32(..1 << bits);
        if random.bool() {
            value.wrapping_neg()
        } else {
            value
        }
    };
    format!(
        "{:08x} {:08x} {:08x} {distance:08x}",
        part(),
        part(),
        part()
    )
}

/// Returns a command for a held demo.
fn held(random: &mut Rng, tick: &mut u32) -> String {
    match random.u8(..6) {
        0 | 1 => setting(random),
        2 => format!("show {}", random.u32(..)),
        3 => {
            let distance = random.u32(1 << 17..4 << 16);
            let pose = turn(random, 31, distance);
            format!("show pose {pose}")
        }
        4 => {
            let motion = turn(random, 27, 0);
            format!("show {} motion {motion}", random.u32(..))
        }
        _ => match random.u8(..3) {
            0 => format!("show at {}", random.u32(..*tick + 10)),
            _ => {
                *tick += random.u32(..3);
                let action = choice(random, Action::ALL);
                format!("steer {tick} {action}")
            }
        },
    }
}

/// Returns a command for a running demo, or any other command.
fn any(random: &mut Rng, tick: &mut u32) -> String {
    match random.u8(..12) {
        0 => "run".into(),
        1 => "hold".into(),
        2 => setting(random),
        3..7 => {
            let action = choice(random, Action::ALL);
            format!("steer {action}")
        }
        7 => "steer quality".into(),
        _ => held(random, tick),
    }
}

/// Returns a dump's lines, without those that depend on the page or are a checksum over the dump.
fn dump(show: &mut Show<'_, Vga>, what: &str) -> Vec<String> {
    let mut dump = done(show, what, 0);
    dump.retain(|line| !line.starts_with("start ") && !line.starts_with("end "));
    dump
}

/// Draws the frame that a dump's header names.
fn draw_again(show: &mut Show<'_, Vga>, header: &[String]) {
    let line = |name: &str| {
        let mut lines = header.iter();
        let rest = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        rest.unwrap_or_else(|| panic!("no line '{name}' in {header:?}"))
    };
    done(show, &format!("scene {}", line("scene")), 0);
    assert_eq!(line("model"), "none");
    match (line("mapper"), line("frame"), line("motion")) {
        ("none", "none", "none") => {}
        (mapper, frame, motion) => {
            done(show, &format!("mapper {mapper}"), 0);
            let show_it = match motion {
                "none" => format!("show {frame}"),
                motion => format!("show {frame} motion {motion}"),
            };
            done(show, &show_it, 0);
        }
    }
}

/// Returns everything observable of a demo: checksums of its memory, header, state, counts, log and settings.
fn all(show: &mut Show<'_, Vga>) -> Vec<String> {
    let mut all = done(show, "checksums all", 0);
    all.extend(done(show, "dump", 0).drain(..9));
    for what in ["state", "counts", "log", "scene", "mapper", "order"] {
        all.extend(done(show, what, 0));
    }
    all.retain(|line| !line.starts_with("keys "));
    all
}

/// After each of some random commands, the header of a dump is enough to draw the dump again.
#[test]
fn a_header_is_enough_to_draw_the_dump_again() {
    let mut random = seeded::generator();
    let mut memories = [memory(), memory()];
    let [memory, other] = &mut memories;
    let mut show = Show::new(memory, Vga::new(), None).unwrap();
    let mut twin = Show::new(other, Vga::new(), None).unwrap();
    done(&mut twin, "hold", 0);
    let (mut tick, mut said, mut overlaid) = (1, Vec::new(), false);
    for _ in 0..seeded::cases(COMMANDS) {
        let command = any(&mut random, &mut tick);
        let answer = ask(&mut show, &command, tick);
        said.push(format!("{command} -> {}", answer.last().unwrap()));
        let running = done(&mut show, "state", tick)[0].starts_with("running");
        if running && random.bool() {
            tick += random.u32(1..3);
            show.present(tick, &mut |_| {});
            said.push(format!("(tick {tick})"));
        }
        // Frames under an overlay have no name, so they are not compared.
        overlaid = running
            && (overlaid
                || Action::ALL
                    .iter()
                    .any(|action| action.is_overlay() && command == format!("steer {action}")));
        if !overlaid {
            let dumped = dump(&mut show, "dump");
            draw_again(&mut twin, &dumped);
            let again = dump(&mut twin, "dump");
            assert!(
                dumped == again,
                "{:?} was drawn again as {:?}, {} lines differ, after {said:#?}",
                &dumped[..8],
                &again[..8],
                dumped.iter().zip(&again).filter(|(a, b)| a != b).count(),
            );
        }
    }
}

/// A demo after `hold` is in the same state as a new demo, for any commands that follow.
#[test]
fn after_hold_nothing_depends_on_what_was_before() {
    let mut random = seeded::generator();
    let mut memories = [memory(), memory()];
    let [memory, other] = &mut memories;
    let mut show = Show::new(memory, Vga::new(), None).unwrap();
    for _ in 0..seeded::cases(COMMANDS / 10) {
        let mut said = Vec::new();
        let mut tick = 1;
        for _ in 0..random.u32(..10) {
            let command = any(&mut random, &mut tick);
            ask(&mut show, &command, tick);
            said.push(command);
            tick += 1;
            show.present(tick, &mut |_| {});
        }
        let mut fresh = Show::new(other, Vga::new(), None).unwrap();
        let mut tick = 1;
        for command in ["hold".to_string()]
            .into_iter()
            .chain((0..REPEATED).map(|_| held(&mut random, &mut tick)))
        {
            said.push(command.clone());
            assert_eq!(ask(&mut show, &command, 0), ask(&mut fresh, &command, 0));
            assert_eq!(all(&mut show), all(&mut fresh), "after {said:#?}");
        }
    }
}
