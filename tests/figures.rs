//! The README's figures: `cargo figures`.

use std::time::{Duration, Instant};

use crystal_ball::card::Card;
use crystal_ball::machine::{Config, Machine};
use crystal_ball::setup::{self, Options};
use link::{Command, Picture};

/// How long the running show is watched.
const WATCHED: Duration = Duration::from_secs(60);
/// Boots that the times are the median of.
const BOOTS: usize = 5;

#[test]
#[ignore = "measures for two minutes; run it alone, by `cargo figures`"]
fn figures() {
    let options = Options::default();
    let ready = setup::ready(&options).expect("the set-up");
    let config = Config::new(&ready);
    let (mut set_ups, mut kernels, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..BOOTS {
        let start = Instant::now();
        setup::ready(&options).expect("the set-up, warm");
        set_ups.push(start.elapsed());
        let start = Instant::now();
        let mut machine = Machine::boot(&config).expect("boots");
        kernels.push(start.elapsed());
        machine.wait_until_running().expect("runs");
        pictures.push(start.elapsed());
        machine.leave().expect("leaves");
    }
    println!("set-up, warm:                  {}", spread(set_ups));
    println!("QEMU's start to the kernel:    {}", spread(kernels));
    println!("QEMU's start to first picture: {}", spread(pictures));

    let mut machine = Machine::boot(&config).expect("boots");
    machine.wait_until_running().expect("runs");
    machine.rest(WATCHED).expect("runs on");
    let counts = machine.ask(Command::Counts).expect("answers");
    let pace = counts
        .iter()
        .find(|line| line.starts_with("pace "))
        .expect("a pace");
    let words: Vec<_> = pace.split(' ').collect();
    let [shown, late] = [words[2], words[4]].map(|n| n.parse::<f64>().expect("a number"));
    println!(
        "pictures within a tick (16.7 ms) of the one before, over {} s: {:.2} % ({shown} shown, {late} late)",
        WATCHED.as_secs(),
        100.0 * (1.0 - late / shown),
    );
    println!("writes for a picture:");
    for frame in [0, 240, 480] {
        machine
            .ask(Command::Show(Picture::Frame(frame)))
            .expect("shows");
        // The pages' first pictures paint all of the background; the third round is the rule.
        for _ in 0..5 {
            machine
                .ask(Command::Show(Picture::Frame(frame)))
                .expect("shows");
        }
        println!("frame {frame}");
        for line in machine.ask(Command::Counts).expect("answers") {
            println!("  {line}");
        }
    }
    machine.leave().expect("leaves");
}

/// Median, least and most.
fn spread(mut times: Vec<Duration>) -> String {
    times.sort();
    let seconds = |i: usize| times[i].as_secs_f64();
    format!(
        "{:.2} s (of {BOOTS}: {:.2} to {:.2})",
        seconds(BOOTS / 2),
        seconds(0),
        seconds(BOOTS - 1)
    )
}
