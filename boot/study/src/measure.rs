//! The cost of drawing on the bare machine, measured by the benchmark kernel.
//!
//! Each CPU model is booted twice. Under `-icount shift=0` the guest's clock counts instructions: the counts
//! are exact, and two rounds with different counts are an error. Under plain TCG the same clock is the
//! host's, and its times are good only for ratios within one round, which are reported as medians with their
//! spread. The frames that the timed kernel drew are compared with the emulated VGA's. The emulated VGA also
//! counts the accesses: see `accesses`.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::{Context, bail, ensure};
use bench::{BenchRequest, Figure, LENGTHS, MAX_ROUNDS, Work};
use protocol::OK;
use texmap::{Mapper, Order};

use qemu::Vm;
use setup::{Options, Ready};
use system::Progress;

mod accesses;

pub use accesses::{Accesses, BenchMemories, EmulatedBenches};

/// A CPU model of QEMU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// QEMU's default model: x86-64 with almost no extensions.
    Baseline,
    /// The model with every extension that TCG supports, bit-extract included.
    Max,
}

impl Cpu {
    /// Both models.
    pub const ALL: [Self; 2] = [Self::Baseline, Self::Max];

    /// Returns QEMU's name for the model.
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

/// The parts to measure.
#[derive(Clone, Debug)]
pub struct MeasureConfig {
    /// The options of the set-up.
    pub options: Options,
    /// The CPU models. Each one needs a few minutes.
    pub cpus: Vec<Cpu>,
    /// The mappers.
    pub mappers: Vec<Mapper>,
    /// The rounds of which times are the median, 1 to [`MAX_ROUNDS`].
    pub rounds: usize,
    /// Whether to measure spans of each length separately, too.
    pub spans: bool,
}

impl Default for MeasureConfig {
    /// Returns the configuration that measures everything, in five rounds.
    fn default() -> Self {
        Self {
            options: Options::default(),
            cpus: Cpu::ALL.to_vec(),
            mappers: Mapper::ALL.iter().map(|&(_, mapper, _)| mapper).collect(),
            rounds: 5,
            spans: true,
        }
    }
}

/// The measured figures.
#[derive(Clone, Debug)]
pub struct KernelFigures {
    /// QEMU's version.
    pub qemu: String,
    /// The figures for each requested CPU model.
    pub cpus: Vec<CpuFigures>,
}

/// The figures for one CPU model.
#[derive(Clone, Debug)]
pub struct CpuFigures {
    /// The model.
    pub cpu: Cpu,
    /// Whether the kernel found BMI2 on the model.
    pub bmi2: bool,
    /// A row for each mapper in each of [`Order::ALL`].
    pub rows: Vec<KernelRow>,
}

impl CpuFigures {
    /// Returns the row of a mapper and an order.
    pub fn row(&self, mapper: Mapper, order: Order) -> Option<&KernelRow> {
        let found = |row: &&KernelRow| row.mapper == mapper && row.order == order;
        self.rows.iter().find(found)
    }
}

/// The costs of a mapper in an order.
#[derive(Clone, Debug)]
pub struct KernelRow {
    /// The mapper.
    pub mapper: Mapper,
    /// The order.
    pub order: Order,
    /// The cost of each piece of work. The references ([`Work::BareRam`], [`Work::BareCard`],
    /// [`Work::Present`]) ran in the same rounds as the other work.
    pub works: BTreeMap<Work, WorkCost>,
    /// The costs of spans of one length, drawn in RAM; empty unless [`MeasureConfig::spans`] was set.
    pub spans: Vec<SpanCost>,
    /// The accesses of one frame of the ball to the emulated VGA.
    pub accesses: Accesses,
}

impl KernelRow {
    /// Returns the cost of a piece of work.
    ///
    /// # Panics
    /// Never, because a row has every [`Work::ALL`].
    pub fn cost(&self, work: Work) -> &WorkCost {
        &self.works[&work]
    }

    /// Returns the work that erases, draws and flips a whole frame of the ball in this order.
    pub fn whole_frame(&self) -> Work {
        accesses::whole_frame(self.order)
    }

    /// Returns the instructions a pixel of a full screen drawn in RAM. They include the cost of each column,
    /// but not the cost of making its job, which is in [`Work::ScreenJobs`].
    pub fn instructions_a_pixel(&self) -> f64 {
        self.cost(Work::ScreenRam).instructions_a_pixel()
    }

    /// Returns the time of a whole frame of the ball, relative to bare byte stores of as many pixels.
    pub fn frame_over_bare(&self) -> TimeRatio {
        self.ratio(self.whole_frame(), Work::BareCard)
    }

    /// Returns the time of a whole frame of the ball, relative to presenting the same bytes already drawn.
    pub fn frame_over_present(&self) -> TimeRatio {
        self.ratio(self.whole_frame(), Work::Present)
    }

    /// Returns the time a pixel of `work`, relative to that of `over`, round by round.
    pub fn ratio(&self, work: Work, over: Work) -> TimeRatio {
        self.cost(work).over(self.cost(over))
    }
}

/// The cost of a piece of work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkCost {
    /// The pixels that it draws.
    pub pixels: u64,
    /// The instructions, exact.
    pub instructions: u64,
    /// The times under plain TCG, round by round, in ticks of the host's clock. They are good only for
    /// ratios to other times of the same round.
    pub ticks: Vec<u64>,
}

impl WorkCost {
    /// Returns the instructions a pixel.
    pub fn instructions_a_pixel(&self) -> f64 {
        self.instructions as f64 / self.pixels as f64
    }

    /// Returns the time a pixel, relative to the other cost's, round by round.
    pub fn over(&self, other: &Self) -> TimeRatio {
        let a_pixel = |cost: &Self, ticks: u64| ticks as f64 / cost.pixels as f64;
        let rounds = self.ticks.iter().zip(&other.ticks);
        let mut ratios: Vec<f64> = rounds
            .map(|(&mine, &its)| a_pixel(self, mine) / a_pixel(other, its))
            .collect();
        let least = |cost: &Self| cost.ticks.iter().copied().min().unwrap_or(0);
        let undisturbed = a_pixel(self, least(self)) / a_pixel(other, least(other));
        ratios.sort_by(f64::total_cmp);
        TimeRatio {
            median: ratios[ratios.len() / 2],
            least: ratios[0],
            most: ratios[ratios.len() - 1],
            undisturbed,
        }
    }
}

/// A ratio of times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeRatio {
    /// The median of the rounds' ratios.
    pub median: f64,
    /// The smallest of the rounds' ratios.
    pub least: f64,
    /// The largest of the rounds' ratios.
    pub most: f64,
    /// The ratio of the two shortest times. A disturbance can only make a round longer, so on a busy host
    /// this ratio is still valid when the median is not.
    pub undisturbed: f64,
}

impl fmt::Display for TimeRatio {
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

/// The costs of spans of one length.
#[derive(Clone, Debug)]
pub struct SpanCost {
    /// The pixels of each span.
    pub length: u16,
    /// The cost of making the jobs of a face with such spans.
    pub jobs: WorkCost,
    /// The cost of drawing the jobs in RAM.
    pub draw: WorkCost,
}

/// Builds the benchmark kernel if necessary, boots it, and measures the parts that `config` names.
///
/// # Errors
/// As [`setup::ready`]; a [`qemu::Failure`]; counts that do not repeat under `-icount`; and frames that
/// differ from the emulated VGA's.
pub fn run(config: &MeasureConfig) -> anyhow::Result<KernelFigures> {
    ensure!(
        (1..=MAX_ROUNDS).contains(&config.rounds),
        "{} rounds; the limits are 1 to {MAX_ROUNDS}",
        config.rounds
    );
    let ready = setup::ready_to_measure(&config.options)?;
    let mut memories = BenchMemories::default();
    let mut emulated = EmulatedBenches::new(&mut memories);
    let all = config.cpus.len() * config.mappers.len() * Order::ALL.len() * 2;
    let mut step = Progress::counting("measuring in QEMU", all as u64);
    let mut done = 0..;
    let mut tick = || step.at(done.next().unwrap_or(0));
    let mut cpus = Vec::new();
    for &cpu in &config.cpus {
        let mut counting = Guest::boot(&ready, cpu, &["-icount", "shift=0"])?;
        let a_tick = counting.ticks_an_instruction()?;
        let mut counted = Vec::new();
        for (mapper, order) in combinations(config) {
            counted.push(counting.measure(mapper, order, 2, config.spans)?);
            tick();
        }
        counting.vm.leave()?;
        let mut timing = Guest::boot(&ready, cpu, &[])?;
        let mut rows = Vec::new();
        for ((mapper, order), counted) in combinations(config).zip(counted) {
            emulated.compare(
                mapper,
                order,
                &timing.send(BenchRequest::Check(mapper, order))?,
            )?;
            let timed = timing.measure(mapper, order, config.rounds, config.spans)?;
            tick();
            rows.push(KernelRow {
                mapper,
                order,
                works: counted.costs(&timed, a_tick)?,
                spans: counted.span_costs(&timed, a_tick)?,
                accesses: emulated.accesses(mapper, order)?,
            });
        }
        let bmi2 = timing.has_bmi2()?;
        timing.vm.leave()?;
        cpus.push(CpuFigures { cpu, bmi2, rows });
    }
    Ok(KernelFigures {
        qemu: ready.qemu.version.clone(),
        cpus,
    })
}

/// Returns the mappers and orders to measure.
fn combinations(config: &MeasureConfig) -> impl Iterator<Item = (Mapper, Order)> {
    let mappers = config.mappers.iter();
    mappers.flat_map(|&mapper| Order::ALL.map(|(_, order, _)| (mapper, order)))
}

/// A machine that runs the benchmark kernel.
struct Guest {
    vm: Vm,
}

impl Guest {
    fn boot(ready: &Ready, cpu: Cpu, arguments: &[&str]) -> anyhow::Result<Self> {
        let arguments = ["-cpu", cpu.name()]
            .into_iter()
            .chain(arguments.iter().copied());
        let vm = Vm::boot(&qemu::Config {
            arguments: arguments.map(Into::into).collect(),
            ..qemu::Config::new(ready)
        })?;
        Ok(Self { vm })
    }

    /// Sends a request, and returns the lines of the answer without its last line.
    fn send(&mut self, request: BenchRequest) -> anyhow::Result<Vec<String>> {
        let request = request.to_string();
        self.vm.send_line(&request)?;
        let mut answer = self.vm.answer(&request)?;
        match answer.pop() {
            Some(last) if last == format!("{OK} {request}") => Ok(answer),
            last => bail!(
                "the benchmark kernel refused '{request}': {}",
                last.unwrap_or_default()
            ),
        }
    }

    /// Returns the ticks of the clock for each instruction, from a loop of known length.
    ///
    /// # Errors
    /// If the clock does not count instructions.
    fn ticks_an_instruction(&mut self) -> anyhow::Result<u64> {
        let answer = self.send(BenchRequest::Calibrate)?;
        let fields: Vec<&str> = answer
            .first()
            .map_or("", String::as_str)
            .split(' ')
            .collect();
        let ["instructions", instructions, "ticks", ticks] = fields[..] else {
            bail!(
                "the benchmark kernel answered '{}' with {answer:?}; expected 'instructions N ticks N'",
                BenchRequest::Calibrate
            );
        };
        let (instructions, ticks): (u64, u64) = (instructions.parse()?, ticks.parse()?);
        let each = ticks.checked_div(instructions).unwrap_or(0);
        ensure!(
            each > 0 && each * instructions == ticks,
            "under -icount QEMU's time stamp counter must count instructions, but it counted {ticks} \
             ticks for {instructions} instructions"
        );
        Ok(each)
    }

    fn has_bmi2(&mut self) -> anyhow::Result<bool> {
        let answer = self.send(BenchRequest::Calibrate)?;
        Ok(answer.iter().any(|line| line == "bmi2 yes"))
    }

    fn measure(
        &mut self,
        mapper: Mapper,
        order: Order,
        rounds: usize,
        spans: bool,
    ) -> anyhow::Result<Reported> {
        let mut figures = self.figures(BenchRequest::Measure(mapper, order, rounds))?;
        if spans {
            figures.append(&mut self.figures(BenchRequest::Spans(mapper, order, rounds))?);
        }
        Ok(Reported { figures })
    }

    /// Requests figures, and returns them by name.
    fn figures(&mut self, request: BenchRequest) -> anyhow::Result<BTreeMap<String, Figure>> {
        let answer = self.send(request)?;
        let figures = answer.iter().map(|line| {
            let mut fields = line.split(' ');
            let name = fields.next().unwrap_or_default().to_string();
            let figure = Figure::parse(fields);
            figure.map(|figure| (name, figure)).with_context(|| {
                format!("the benchmark kernel answered '{request}' with '{line}'; expected figures")
            })
        });
        figures.collect()
    }
}

/// The figures of one machine for a mapper and an order.
struct Reported {
    figures: BTreeMap<String, Figure>,
}

impl Reported {
    /// Returns the costs of all work, with the instructions of `self` and the times of `timed`.
    fn costs(&self, timed: &Self, a_tick: u64) -> anyhow::Result<BTreeMap<Work, WorkCost>> {
        let all = Work::ALL.iter();
        all.map(|&work| Ok((work, self.cost(&work.to_string(), timed, a_tick)?)))
            .collect()
    }

    fn span_costs(&self, timed: &Self, a_tick: u64) -> anyhow::Result<Vec<SpanCost>> {
        let name = |length| format!("span-{length}-jobs");
        let lengths = LENGTHS.into_iter();
        let reported = lengths.filter(|&length| self.figures.contains_key(&name(length)));
        reported
            .map(|length| {
                Ok(SpanCost {
                    length,
                    jobs: self.cost(&name(length), timed, a_tick)?,
                    draw: self.cost(&format!("span-{length}-draw"), timed, a_tick)?,
                })
            })
            .collect()
    }

    fn cost(&self, name: &str, timed: &Self, a_tick: u64) -> anyhow::Result<WorkCost> {
        let figure = |reported: &Self| {
            let figure = reported.figures.get(name).copied();
            figure.with_context(|| format!("'{name}': the benchmark kernel reported no figure"))
        };
        let (counted, timed) = (figure(self)?, figure(timed)?);
        ensure!(
            counted.pixels() == timed.pixels(),
            "'{name}': {} pixels under -icount, {} without; both must draw the same",
            counted.pixels(),
            timed.pixels()
        );
        Ok(WorkCost {
            pixels: counted.pixels(),
            instructions: repeated(name, &counted, a_tick)?,
            ticks: timed.ticks().to_vec(),
        })
    }
}

/// Returns the instructions of a figure, if it is the same in each round.
fn repeated(name: &str, figure: &Figure, a_tick: u64) -> anyhow::Result<u64> {
    let ticks = figure.ticks();
    ensure!(
        ticks.iter().all(|other| other == &ticks[0]) && ticks[0].is_multiple_of(a_tick),
        "'{name}': rounds under -icount must have equal ticks, a multiple of {a_tick}; they have \
         {ticks:?}"
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

    fn reported(name: &str, figure: Figure) -> Reported {
        Reported {
            figures: BTreeMap::from([(name.to_string(), figure)]),
        }
    }

    #[test]
    fn a_ratio_compares_times_a_pixel_of_the_same_round() {
        let cost = |pixels, ticks: &[u64]| WorkCost {
            pixels,
            instructions: 0,
            ticks: ticks.to_vec(),
        };
        // A disturbance lengthened the second round of both, and the third round of the reference alone.
        let ratio = cost(10, &[20, 200, 22]).over(&cost(5, &[20, 100, 40]));
        let expected = TimeRatio {
            median: 0.5,
            least: 0.275,
            most: 1.0,
            undisturbed: 0.5,
        };
        assert_eq!(ratio, expected);
    }

    #[test]
    fn instructions_that_differ_between_rounds_are_an_error() {
        let timed = reported("screen-ram", figure(7, &[100, 90]));
        let cost = |counted| reported("screen-ram", counted).cost("screen-ram", &timed, 2);
        let good = cost(figure(7, &[60, 60])).unwrap();
        assert_eq!((good.instructions, good.ticks), (30, vec![100, 90]));
        for (bad, why) in [
            (figure(7, &[60, 62]), "must have equal ticks"),
            (figure(7, &[61, 61]), "must have equal ticks"),
            (figure(8, &[60, 60]), "8 pixels under -icount, 7 without"),
        ] {
            let error = cost(bad).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
        let missing = reported("bare-ram", figure(7, &[60])).cost("screen-ram", &timed, 2);
        assert!(missing.is_err());
    }
}
