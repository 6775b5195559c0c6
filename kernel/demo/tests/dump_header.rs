//! Properties of dump headers after any sequence of commands: the header is enough to draw the dump again,
//! and after `hold` nothing depends on earlier commands.

mod common;

use common::{ask, carry_out, memory};
use demo::Demo;
use fastrand::Rng;
use protocol::Action;
use scene::catalogue::CATALOGUE;
use texmap::{Mapper, Order};
use vga::Vga;

/// Commands in a sequence.
const COMMANDS: usize = 60;
/// Commands after a `hold`.
const COMMANDS_AFTER_HOLD: u32 = 5;

fn choose<T: Copy>(random: &mut Rng, all: &[T]) -> T {
    all[random.usize(..all.len())]
}

/// Returns `scene`, `mapper` or `order`, and a name.
fn setting(random: &mut Rng) -> String {
    match random.u8(..4) {
        0 => {
            let scene = &CATALOGUE[random.usize(..CATALOGUE.len())];
            format!("scene {}", scene.name)
        }
        1 => format!("order {}", choose(random, &Order::ALL).0),
        // Mappers that reduced quality affects are chosen more often.
        2 => format!("mapper {}", choose(random, &["exact", "within-1/4"])),
        _ => format!("mapper {}", choose(random, Mapper::ALL).0),
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
fn held_command(random: &mut Rng, tick: &mut u32) -> String {
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
                let action = choose(random, Action::ALL);
                format!("steer {tick} {action}")
            }
        },
    }
}

/// Returns a command for a running demo, or any other command.
fn any_command(random: &mut Rng, tick: &mut u32) -> String {
    match random.u8(..12) {
        0 => "run".into(),
        1 => "hold".into(),
        2 => setting(random),
        3..7 => {
            let action = choose(random, Action::ALL);
            format!("steer {action}")
        }
        7 => "steer quality".into(),
        _ => held_command(random, tick),
    }
}

/// Returns a dump's lines, without those that depend on the page or are a checksum over the dump.
fn dump(demo: &mut Demo<'_, Vga>, what: &str) -> Vec<String> {
    let mut dump = carry_out(demo, what, 0);
    dump.retain(|line| !line.starts_with("start ") && !line.starts_with("end "));
    dump
}

/// Draws the frame that a dump's header names.
fn draw_again(demo: &mut Demo<'_, Vga>, header: &[String]) {
    let line = |name: &str| {
        let mut lines = header.iter();
        let rest = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        rest.unwrap_or_else(|| panic!("no line '{name}' in {header:?}"))
    };
    carry_out(demo, &format!("scene {}", line("scene")), 0);
    assert_eq!(line("model"), "none");
    match (line("mapper"), line("frame"), line("motion")) {
        ("none", "none", "none") => {}
        (mapper, frame, motion) => {
            carry_out(demo, &format!("mapper {mapper}"), 0);
            let command = match motion {
                "none" => format!("show {frame}"),
                motion => format!("show {frame} motion {motion}"),
            };
            carry_out(demo, &command, 0);
        }
    }
}

/// Returns everything observable of a demo: checksums of its memory, header, state, counts, log and settings.
fn observed(demo: &mut Demo<'_, Vga>) -> Vec<String> {
    let mut lines = carry_out(demo, "checksums all", 0);
    lines.extend(carry_out(demo, "dump", 0).drain(..9));
    for what in ["state", "counts", "log", "scene", "mapper", "order"] {
        lines.extend(carry_out(demo, what, 0));
    }
    lines.retain(|line| !line.starts_with("keys "));
    lines
}

/// After each of some random commands, the header of a dump is enough to draw the dump again.
#[test]
fn a_header_is_enough_to_draw_the_dump_again() {
    let mut random = seeded::generator();
    let mut memories = [memory(), memory()];
    let [memory, other] = &mut memories;
    let mut demo = Demo::new(memory, Vga::new(), None).unwrap();
    let mut second = Demo::new(other, Vga::new(), None).unwrap();
    carry_out(&mut second, "hold", 0);
    let (mut tick, mut history, mut has_overlay) = (1, Vec::new(), false);
    for _ in 0..seeded::cases(COMMANDS) {
        let command = any_command(&mut random, &mut tick);
        let answer = ask(&mut demo, &command, tick);
        history.push(format!("{command} -> {}", answer.last().unwrap()));
        let running = carry_out(&mut demo, "state", tick)[0].starts_with("running");
        if running && random.bool() {
            tick += random.u32(1..3);
            demo.present(tick, &mut |_| {});
            history.push(format!("(tick {tick})"));
        }
        // Frames under an overlay have no name, so they are not compared.
        has_overlay = running
            && (has_overlay
                || Action::ALL
                    .iter()
                    .any(|action| action.is_overlay() && command == format!("steer {action}")));
        if !has_overlay {
            let dumped = dump(&mut demo, "dump");
            draw_again(&mut second, &dumped);
            let again = dump(&mut second, "dump");
            assert!(
                dumped == again,
                "{:?} was drawn again as {:?}, {} lines differ, after {history:#?}",
                &dumped[..8],
                &again[..8],
                dumped.iter().zip(&again).filter(|(a, b)| a != b).count(),
            );
        }
    }
}

/// A demo after `hold` is in the same state as a new demo, for any commands that follow.
#[test]
fn after_hold_nothing_depends_on_earlier_commands() {
    let mut random = seeded::generator();
    let mut memories = [memory(), memory()];
    let [memory, other] = &mut memories;
    let mut demo = Demo::new(memory, Vga::new(), None).unwrap();
    for _ in 0..seeded::cases(COMMANDS / 10) {
        let mut history = Vec::new();
        let mut tick = 1;
        for _ in 0..random.u32(..10) {
            let command = any_command(&mut random, &mut tick);
            ask(&mut demo, &command, tick);
            history.push(command);
            tick += 1;
            demo.present(tick, &mut |_| {});
        }
        let mut fresh = Demo::new(other, Vga::new(), None).unwrap();
        let mut tick = 1;
        for command in ["hold".to_string()]
            .into_iter()
            .chain((0..COMMANDS_AFTER_HOLD).map(|_| held_command(&mut random, &mut tick)))
        {
            history.push(command.clone());
            assert_eq!(ask(&mut demo, &command, 0), ask(&mut fresh, &command, 0));
            assert_eq!(
                observed(&mut demo),
                observed(&mut fresh),
                "after {history:#?}"
            );
        }
    }
}
