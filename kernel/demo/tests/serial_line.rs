//! How the serial line's errors reach a demo, and how often commands reset the card.

mod common;

use common::{ask, carry_out, memory};
use demo::{Demo, Request};
use modex::Purpose;
use modex::registers::MISC_WRITE;
use protocol::{Command, FailKind, Reception};
use vga::Vga;

/// Returns how often the card's mode was set.
fn mode_sets(demo: &mut Demo<'_, Vga>) -> u64 {
    demo.bus().port_writes(Purpose::Setup, MISC_WRITE, None)
}

#[test]
fn each_command_resets_the_card_at_most_once() {
    let mut memory = memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let mut before = mode_sets(&mut demo);
    assert_eq!(before, 1);
    for (line, resets) in [
        ("steer next-scene", 1),
        ("steer faster", 0),
        ("hold", 1),
        ("scene cube", 1),
        ("show 3", 0),
        ("scene cube", 1),
        ("mapper exact", 0),
        ("hold", 1),
        ("steer 5 next-scene", 0),
        ("show at 9", 1),
        ("show at 10", 0),
        ("run", 0),
        ("scene knot", 1),
        ("show 7", 1),
    ] {
        carry_out(&mut demo, line, 0);
        let after = mode_sets(&mut demo);
        assert_eq!(after - before, resets, "{line}");
        before = after;
    }
}

#[test]
fn a_line_with_a_lost_byte_is_not_carried_out() {
    let mut memory = memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    carry_out(&mut demo, "hold", 0);
    let mut answers = Vec::new();
    // The bytes that arrive look like a command.
    for &byte in b"scene cu" {
        demo.receive(byte, 0, &mut |line| answers.push(line.to_string()));
    }
    demo.damage();
    for &byte in b"be\rmapper exact\r" {
        demo.receive(byte, 0, &mut |line| answers.push(line.to_string()));
    }
    let refused = "error bytes of the line were lost or damaged on the wire; send the line again";
    assert_eq!(answers, [refused, "ok mapper exact"]);
    let state = carry_out(&mut demo, "state", 0);
    assert!(state.contains(&"scene ball".into()), "{state:?}");
}

#[test]
fn the_state_contains_the_errors_of_the_line() {
    let mut memory = memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let last = |demo: &mut Demo<'_, Vga>| ask(demo, "state", 0).into_iter().rev().nth(1);
    let no_errors = "serial overruns 0 damaged 0 full 0";
    assert_eq!(last(&mut demo).as_deref(), Some(no_errors));
    demo.set_reception(Reception {
        overruns: 1,
        damaged: 2,
        full: 3,
    });
    let errors = "serial overruns 1 damaged 2 full 3";
    assert_eq!(last(&mut demo).as_deref(), Some(errors));
}

#[test]
fn only_leave_and_fail_ask_the_machine_for_something() {
    let mut memory = memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let mut request = |command| demo.obey(command, 0, &mut |_| {});
    assert_eq!(request(Command::Hold), None);
    assert_eq!(request(Command::ShowAt(1)), None);
    assert_eq!(request(Command::Leave), Some(Request::Leave));
    let panic = FailKind::Panic;
    assert_eq!(request(Command::Fail(panic)), Some(Request::Fail(panic)));
}
