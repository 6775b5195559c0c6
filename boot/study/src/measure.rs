//! What drawing costs inside the bare machine: the measuring kernel, asked and read.
//!
//! Each CPU model is booted twice. Under `-icount shift=0` the guest's clock counts instructions:
//! figures are exact and must come twice the same, or there is an error. Under plain TCG the same
//! clock is the host's, and times are good for ratios within one round alone; they come as medians
//! with their spread. What the timed kernel drew is compared with what the emulated card holds, and
//! there the accesses are counted, too: see `accesses`.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::{Context, bail, ensure};
use cost::{Ask, Figure, LENGTHS, MAX_ROUNDS, Work};
use link::OK;
use texmap::{Mapper, Order};

use qemu::Machine;
use setup::{Options, Ready};
use system::Step;

mod accesses;

pub use accesses::{Accesses, Emulated, Memories};

/// A CPU model of QEMU's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// What QEMU takes if nothing is said: x86-64 and next to nothing more.
    Baseline,
    /// All that TCG can, bit-extract with it.
    Max,
}

impl Cpu {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Baseline, Self::Max];

    /// QEMU's name for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "qemu64",
            Self::Max => "max",
        }
    }
}

impl fmt::Display for Cpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What is measured.
#[derive(Clone, Debug)]
pub struct Config {
    /// For the set-up.
    pub options: Options,
    /// The CPU models, a few minutes each.
    pub cpus: Vec<Cpu>,
    /// The mappers.
    pub mappers: Vec<Mapper>,
    /// Rounds that times are the median of, 1 to [`MAX_ROUNDS`].
    pub rounds: usize,
    /// Whether runs of each length are measured by themselves, too.
    pub runs: bool,
}

impl Default for Config {
    /// All of it, in five rounds.
    fn default() -> Self {
        Self {
            options: Options::default(),
            cpus: Cpu::ALL.to_vec(),
            mappers: Mapper::ALL.iter().map(|&(_, mapper, _)| mapper).collect(),
            rounds: 5,
            runs: true,
        }
    }
}

/// What was measured.
#[derive(Clone, Debug)]
pub struct Measured {
    /// QEMU's version.
    pub qemu: String,
    /// For each CPU model that was asked for.
    pub cpus: Vec<OnCpu>,
}

/// What was measured on one CPU model.
#[derive(Clone, Debug)]
pub struct OnCpu {
    /// The model.
    pub cpu: Cpu,
    /// Whether the kernel found BMI2 on it.
    pub bmi2: bool,
    /// A row for each mapper in each of [`Order::ALL`].
    pub rows: Vec<Row>,
}

impl OnCpu {
    /// The row of a mapper and order.
    pub fn row(&self, mapper: Mapper, order: Order) -> Option<&Row> {
        let found = |row: &&Row| row.mapper == mapper && row.order == order;
        self.rows.iter().find(found)
    }
}

/// What a mapper costs in an order.
#[derive(Clone, Debug)]
pub struct Row {
    /// The mapper.
    pub mapper: Mapper,
    /// The order.
    pub order: Order,
    /// What each piece of work took. The references ([`Work::BareRam`], [`Work::BareCard`],
    /// [`Work::Present`]) were done in the same rounds as the others.
    pub works: BTreeMap<Work, Cost>,
    /// What runs of one length took, in RAM; empty unless it was asked for.
    pub runs: Vec<RunCost>,
    /// What a picture of the ball does to the card.
    pub accesses: Accesses,
}

impl Row {
    /// What a piece of work took.
    ///
    /// # Panics
    /// Never: a row has all of [`Work::ALL`].
    pub fn cost(&self, work: Work) -> &Cost {
        &self.works[&work]
    }

    /// The work that is a whole frame of the ball in this order, erased, drawn and flipped.
    pub fn whole_frame(&self) -> Work {
        whole_frame(self.order)
    }

    /// Instructions a pixel on a full screen in RAM, jobs made beforehand; what a column costs is in
    /// it, what its job costs is [`Work::ScreenJobs`].
    pub fn instructions_a_pixel(&self) -> f64 {
        self.cost(Work::ScreenRam).instructions_a_pixel()
    }

    /// How long a whole frame of the ball takes over bare byte stores of as many pixels.
    pub fn frame_over_bare(&self) -> Spread {
        self.ratio(self.whole_frame(), Work::BareCard)
    }

    /// How long a whole frame of the ball takes over presenting the same bytes already drawn.
    pub fn frame_over_present(&self) -> Spread {
        self.ratio(self.whole_frame(), Work::Present)
    }

    /// The time of a work over that of another, a pixel of each, round by round.
    pub fn ratio(&self, work: Work, over: Work) -> Spread {
        self.cost(work).over(self.cost(over))
    }
}

/// The work that is a whole frame of the ball in an order.
fn whole_frame(order: Order) -> Work {
    match order {
        Order::Polygons | Order::Planes => Work::FrameCard,
        Order::Buffer => Work::FramePresented,
    }
}

/// What a piece of work took.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Pixels drawn in it.
    pub pixels: u64,
    /// Instructions, exact.
    pub instructions: u64,
    /// Times under plain TCG, round by round, in ticks of the host's clock: good for ratios to
    /// others of the same round.
    pub ticks: Vec<u64>,
}

impl Cost {
    /// Instructions a pixel.
    pub fn instructions_a_pixel(&self) -> f64 {
        self.instructions as f64 / self.pixels as f64
    }

    /// The time of a pixel over that of one of the other's, round by round.
    pub fn over(&self, other: &Self) -> Spread {
        let a_pixel = |cost: &Self, ticks: u64| ticks as f64 / cost.pixels as f64;
        let rounds = self.ticks.iter().zip(&other.ticks);
        let mut ratios: Vec<f64> = rounds
            .map(|(&mine, &its)| a_pixel(self, mine) / a_pixel(other, its))
            .collect();
        let least = |cost: &Self| cost.ticks.iter().copied().min().unwrap_or(0);
        let undisturbed = a_pixel(self, least(self)) / a_pixel(other, least(other));
        ratios.sort_by(f64::total_cmp);
        Spread {
            median: ratios[ratios.len() / 2],
            least: ratios[0],
            most: ratios[ratios.len() - 1],
            undisturbed,
        }
    }
}

/// A ratio of times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median of the rounds' ratios.
    pub median: f64,
    /// The least of them.
    pub least: f64,
    /// The most.
    pub most: f64,
    /// The least time over the other's least. What disturbs a round only ever adds to it: on a busy
    /// host this holds when the median does not.
    pub undisturbed: f64,
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            median,
            least,
            most,
            undisturbed,
        } = self;
        write!(
            f,
            "{median:.2} ({least:.2} to {most:.2}; of the least times {undisturbed:.2})"
        )
    }
}

/// What runs of one length took.
#[derive(Clone, Debug)]
pub struct RunCost {
    /// Pixels of each run.
    pub length: u16,
    /// Making the jobs of a face of such runs.
    pub jobs: Cost,
    /// Drawing them in RAM.
    pub draw: Cost,
}

/// Builds the measuring kernel if need be, boots it, and measures what `config` asks for.
///
/// # Errors
/// As [`setup::ready`]; a [`qemu::Failure`]; figures that do not repeat under `-icount`, and
/// pictures that differ from those of the emulated card.
pub fn run(config: &Config) -> anyhow::Result<Measured> {
    ensure!(
        (1..=MAX_ROUNDS).contains(&config.rounds),
        "rounds are 1 to {MAX_ROUNDS}"
    );
    let ready = setup::ready_to_measure(&config.options)?;
    let mut memories = Memories::default();
    let mut emulated = Emulated::new(&mut memories);
    let all = config.cpus.len() * config.mappers.len() * Order::ALL.len() * 2;
    let mut step = Step::counting("measuring in QEMU", all as u64);
    let mut done = 0..;
    let mut tick = || step.at(done.next().unwrap_or(0));
    let mut cpus = Vec::new();
    for &cpu in &config.cpus {
        let mut counting = Guest::boot(&ready, cpu, &["-icount", "shift=0"])?;
        let a_tick = counting.ticks_an_instruction()?;
        let mut counted = Vec::new();
        for (mapper, order) in asked(config) {
            counted.push(counting.measure(mapper, order, 2, config.runs)?);
            tick();
        }
        counting.machine.leave()?;
        let mut timing = Guest::boot(&ready, cpu, &[])?;
        let mut rows = Vec::new();
        for ((mapper, order), counted) in asked(config).zip(counted) {
            emulated.compare(mapper, order, &timing.ask(Ask::Check(mapper, order))?)?;
            let timed = timing.measure(mapper, order, config.rounds, config.runs)?;
            tick();
            rows.push(Row {
                mapper,
                order,
                works: counted.costs(&timed, a_tick)?,
                runs: counted.run_costs(&timed, a_tick)?,
                accesses: emulated.accesses(mapper, order)?,
            });
        }
        let bmi2 = timing.has_bmi2()?;
        timing.machine.leave()?;
        cpus.push(OnCpu { cpu, bmi2, rows });
    }
    Ok(Measured {
        qemu: ready.qemu.version.clone(),
        cpus,
    })
}

/// The mappers and orders that the kernel is asked for.
fn asked(config: &Config) -> impl Iterator<Item = (Mapper, Order)> {
    let mappers = config.mappers.iter();
    mappers.flat_map(|&mapper| Order::ALL.map(|(_, order, _)| (mapper, order)))
}

/// A machine that runs the measuring kernel.
struct Guest {
    machine: Machine,
}

impl Guest {
    fn boot(ready: &Ready, cpu: Cpu, arguments: &[&str]) -> anyhow::Result<Self> {
        let arguments = ["-cpu", cpu.name()]
            .into_iter()
            .chain(arguments.iter().copied());
        let machine = Machine::boot(&qemu::Config {
            arguments: arguments.map(Into::into).collect(),
            ..qemu::Config::new(ready)
        })?;
        Ok(Self { machine })
    }

    /// The lines of an answer, without the one that closes it.
    fn ask(&mut self, ask: Ask) -> anyhow::Result<Vec<String>> {
        let ask = ask.to_string();
        self.machine.send_line(&ask)?;
        let mut answer = self.machine.answer(&ask)?;
        match answer.pop() {
            Some(last) if last == format!("{OK} {ask}") => Ok(answer),
            last => bail!(
                "the measuring kernel answered '{ask}' with '{}'",
                last.unwrap_or_default()
            ),
        }
    }

    /// Ticks of the clock for each instruction, told by a loop of known length.
    ///
    /// # Errors
    /// A clock that does not count instructions.
    fn ticks_an_instruction(&mut self) -> anyhow::Result<u64> {
        let answer = self.ask(Ask::Calibrate)?;
        let words: Vec<&str> = answer
            .first()
            .map_or("", String::as_str)
            .split(' ')
            .collect();
        let ["instructions", instructions, "ticks", ticks] = words[..] else {
            bail!("the measuring kernel calibrates with {answer:?}");
        };
        let (instructions, ticks): (u64, u64) = (instructions.parse()?, ticks.parse()?);
        let each = ticks.checked_div(instructions).unwrap_or(0);
        ensure!(
            each > 0 && each * instructions == ticks,
            "under -icount QEMU's time stamp counter should count instructions, and it counts \
             {ticks} ticks for {instructions} of them"
        );
        Ok(each)
    }

    fn has_bmi2(&mut self) -> anyhow::Result<bool> {
        let answer = self.ask(Ask::Calibrate)?;
        Ok(answer.iter().any(|line| line == "bmi2 yes"))
    }

    fn measure(
        &mut self,
        mapper: Mapper,
        order: Order,
        rounds: usize,
        runs: bool,
    ) -> anyhow::Result<Told> {
        let mut figures = self.figures(Ask::Measure(mapper, order, rounds))?;
        if runs {
            figures.append(&mut self.figures(Ask::Runs(mapper, order, rounds))?);
        }
        Ok(Told { figures })
    }

    /// The figures of an answer, by name.
    fn figures(&mut self, ask: Ask) -> anyhow::Result<BTreeMap<String, Figure>> {
        let answer = self.ask(ask)?;
        let figures = answer.iter().map(|line| {
            let mut words = line.split(' ');
            let name = words.next().unwrap_or_default().to_string();
            let figure = Figure::parse(words);
            figure.map(|figure| (name, figure)).with_context(|| {
                format!("the measuring kernel answered '{ask}' with '{line}', which is no figure")
            })
        });
        figures.collect()
    }
}

/// What one machine told of a mapper and order.
struct Told {
    figures: BTreeMap<String, Figure>,
}

impl Told {
    /// The costs of all work: instructions of `self`, times of `timed`.
    fn costs(&self, timed: &Self, a_tick: u64) -> anyhow::Result<BTreeMap<Work, Cost>> {
        let all = Work::ALL.iter();
        all.map(|&(name, work)| Ok((work, self.cost(name, timed, a_tick)?)))
            .collect()
    }

    fn run_costs(&self, timed: &Self, a_tick: u64) -> anyhow::Result<Vec<RunCost>> {
        let name = |length| format!("run-{length}-jobs");
        let lengths = LENGTHS.into_iter();
        let told = lengths.filter(|&length| self.figures.contains_key(&name(length)));
        told.map(|length| {
            Ok(RunCost {
                length,
                jobs: self.cost(&name(length), timed, a_tick)?,
                draw: self.cost(&format!("run-{length}-draw"), timed, a_tick)?,
            })
        })
        .collect()
    }

    fn cost(&self, name: &str, timed: &Self, a_tick: u64) -> anyhow::Result<Cost> {
        let figure = |told: &Self| {
            let figure = told.figures.get(name).copied();
            figure.with_context(|| format!("the measuring kernel told nothing of '{name}'"))
        };
        let (counted, timed) = (figure(self)?, figure(timed)?);
        ensure!(
            counted.pixels() == timed.pixels(),
            "'{name}' drew {} pixels under -icount and {} without",
            counted.pixels(),
            timed.pixels()
        );
        Ok(Cost {
            pixels: counted.pixels(),
            instructions: repeated(name, &counted, a_tick)?,
            ticks: timed.ticks().to_vec(),
        })
    }
}

/// The instructions of a figure that comes the same in each round.
fn repeated(name: &str, figure: &Figure, a_tick: u64) -> anyhow::Result<u64> {
    let ticks = figure.ticks();
    ensure!(
        ticks.iter().all(|other| other == &ticks[0]) && ticks[0].is_multiple_of(a_tick),
        "under -icount '{name}' took {ticks:?} ticks of {a_tick} for an instruction: \
         it does not repeat"
    );
    Ok(ticks[0] / a_tick)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(pixels: u64, ticks: &[u64]) -> Figure {
        let mut figure = Figure::new(pixels);
        ticks.iter().for_each(|&ticks| figure.add(ticks));
        figure
    }

    fn told(name: &str, figure: Figure) -> Told {
        Told {
            figures: BTreeMap::from([(name.to_string(), figure)]),
        }
    }

    #[test]
    fn ratios_are_of_the_same_round_and_a_pixel_each() {
        let cost = |pixels, ticks: &[u64]| Cost {
            pixels,
            instructions: 0,
            ticks: ticks.to_vec(),
        };
        // The second round was disturbed for both, the third for the reference alone.
        let ratio = cost(10, &[20, 200, 22]).over(&cost(5, &[20, 100, 40]));
        let expected = Spread {
            median: 0.5,
            least: 0.275,
            most: 1.0,
            undisturbed: 0.5,
        };
        assert_eq!(ratio, expected);
    }

    #[test]
    fn figures_that_do_not_repeat_are_an_error() {
        let timed = told("screen-ram", figure(7, &[100, 90]));
        let cost = |counted| told("screen-ram", counted).cost("screen-ram", &timed, 2);
        let good = cost(figure(7, &[60, 60])).unwrap();
        assert_eq!((good.instructions, good.ticks), (30, vec![100, 90]));
        for (bad, why) in [
            (figure(7, &[60, 62]), "does not repeat"),
            (figure(7, &[61, 61]), "does not repeat"),
            (figure(8, &[60, 60]), "drew 8 pixels under -icount and 7"),
        ] {
            let error = cost(bad).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
        let missing = told("bare-ram", figure(7, &[60])).cost("screen-ram", &timed, 2);
        assert!(missing.is_err());
    }
}
