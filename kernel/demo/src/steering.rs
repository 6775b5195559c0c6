//! Steering: the state that a running demo's frames depend on, and its changes.
//!
//! A frame is a function of a [`State`] and a tick, and a state changes only at ticks. So the changes and
//! their ticks, which the [`Log`] stores, define every frame: the log gives the same frames again on any
//! machine, however many ticks that machine skips.
//!
//! # Motion
//!
//! Each scene has its own motion: its pose at a time is [`Entry::pose`]. Steering lets that time pass faster
//! or slower, and adds a turn about each axis and a distance. Rates are integers per tick. A change first
//! accumulates the motion since the last change, and then becomes the new starting point. So nothing is
//! summed tick by tick, and no error grows.
//!
//! Keys repeat. The legal ranges bound what a repeated key can do, so holding a key down for an hour does no
//! more than holding it down for a minute.

use protocol::{Action, Change, Setting, Word};
use scene::Pose;
use scene::catalogue::{CATALOGUE, Entry};
use texmap::{Mapper, Order, Tolerance};

/// One (1.0), with 16 fraction bits.
const ONE: u32 = 1 << 16;
/// The rate that one push adds: 1/2880 turn a tick, a quarter of the ball's own rate.
const PUSH: i32 = ((1u64 << 32) / 2880) as i32;
/// Most pushes to one side: one turn in a second and a half.
const MAX_PUSHES: i32 = 32;
/// The change of distance in one step, 16.16: 1/16 unit.
const STEP: i32 = 1 << 12;
/// Most gears up or down. Four gears double the speed, so the range is 1/16 to 16 times.
const MAX_GEAR: i8 = 16;

/// How the pose depends on the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Motion {
    /// The tick of the last change. The other fields describe the motion at that tick.
    since: u32,
    /// The scene's own time, in ticks with 16 fraction bits; 48 bits.
    time: u64,
    /// Whether the scene's own time passes.
    own: bool,
    /// The turn that steering adds to yaw, pitch and roll, in 32-bit fractions of a turn.
    turned: [u32; 3],
    /// Pushes on each angle, which give its rate.
    pushes: [i32; 3],
    /// The distance that steering adds, 16.16.
    distance: i32,
    /// The speed of all motion: 2^(gear / 4) times.
    gear: i8,
    /// Whether all motion stands still, whatever the rates are.
    paused: bool,
}

impl Motion {
    /// The scene's own motion, not steered.
    const OWN: Self = Self {
        since: 0,
        time: 0,
        own: true,
        turned: [0; 3],
        pushes: [0; 3],
        distance: 0,
        gear: 0,
        paused: false,
    };

    /// Returns the speed that the gear gives, 16.16.
    fn factor(&self) -> u32 {
        // 2^(0/4) to 2^(3/4), rounded to nearest.
        const QUARTERS: [u32; 4] = [ONE, 77_936, 92_682, 110_218];
        let factor = QUARTERS[self.gear.rem_euclid(4) as usize];
        match self.gear.div_euclid(4) {
            octaves @ 0.. => factor << octaves,
            octaves => factor >> -octaves,
        }
    }

    /// Returns how much each angle turns in a tick, as a 32-bit fraction of a turn.
    fn rates(&self) -> [i32; 3] {
        let factor = i64::from(self.factor());
        // 32 pushes at 16 times the speed are less than a quarter of a turn, so the rate fits.
        self.pushes
            .map(|pushes| ((i64::from(pushes * PUSH) * factor) >> 16) as i32)
    }

    /// Returns the same motion with `tick` as its starting point.
    fn at(&self, tick: u32) -> Self {
        self.after(if self.paused {
            0
        } else {
            tick.wrapping_sub(self.since)
        })
        .starting(tick)
    }

    fn starting(self, since: u32) -> Self {
        Self { since, ..self }
    }

    /// Returns the motion advanced by `ticks`, with its starting point unchanged.
    fn after(&self, ticks: u32) -> Self {
        let mut after = *self;
        if self.own {
            let passed = u64::from(self.factor()) * u64::from(ticks);
            after.time = self.time.wrapping_add(passed) & ((1 << 48) - 1);
        }
        for (turned, rate) in after.turned.iter_mut().zip(self.rates()) {
            *turned = turned.wrapping_add((rate as u32).wrapping_mul(ticks));
        }
        after
    }

    /// Returns the pose at the motion's starting point.
    fn pose(&self, entry: &Entry<'_>) -> Pose {
        let tick = (self.time >> 16) as u32;
        let part = i64::from(self.time as u32 % ONE);
        let own = entry.pose(tick);
        self.steered(match part {
            0 => own,
            // Interpolate: a slowed-down scene would otherwise stand still for some ticks, and then jump.
            _ => {
                let next = entry.pose(tick.wrapping_add(1));
                between(&own, &entry.following(&own, next), part)
            }
        })
    }

    /// Adds the steered turn and distance to the scene's own pose.
    fn steered(&self, own: Pose) -> Pose {
        let [yaw, pitch, roll] = self.turned;
        Pose {
            yaw: own.yaw.wrapping_add(yaw),
            pitch: own.pitch.wrapping_add(pitch),
            roll: own.roll.wrapping_add(roll),
            distance: (own.distance + self.distance).clamp(0, Pose::MAX_DISTANCE),
        }
    }

    /// Adds a push to one side to angle number `angle`.
    fn push(&mut self, angle: usize, side: i32) {
        self.pushes[angle] = (self.pushes[angle] + side).clamp(-MAX_PUSHES, MAX_PUSHES);
    }

    fn moves(&self) -> bool {
        self.own || self.pushes != [0; 3]
    }

    fn faster(&mut self) {
        match self.moves() {
            true => self.gear = (self.gear + 1).min(MAX_GEAR),
            false => self.own = true,
        }
    }

    fn slower(&mut self) {
        if self.moves() {
            self.gear = (self.gear - 1).max(-MAX_GEAR);
        }
    }

    fn stop(&mut self) {
        (self.own, self.pushes, self.gear) = (false, [0; 3], 0);
    }

    /// Changes the distance by `step`, as far as the pose stays legal.
    fn approach(&mut self, step: i32, entry: &Entry<'_>) {
        let here = self.pose(entry).distance;
        self.distance += (here + step).clamp(0, Pose::MAX_DISTANCE) - here;
    }
}

/// Returns the pose at `part`, with 16 fraction bits, of the way between two poses. Each angle goes the
/// shorter way.
fn between(from: &Pose, to: &Pose, part: i64) -> Pose {
    let angle = |a: u32, b: u32| {
        let way = i64::from(b.wrapping_sub(a) as i32);
        a.wrapping_add(((way * part) >> 16) as u32)
    };
    let way = i64::from(to.distance) - i64::from(from.distance);
    Pose {
        yaw: angle(from.yaw, to.yaw),
        pitch: angle(from.pitch, to.pitch),
        roll: angle(from.roll, to.roll),
        distance: from.distance + ((way * part) >> 16) as i32,
    }
}

/// The available scenes: the catalogue's, and the loaded model if one exists.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scenes<'a> {
    model: Option<Entry<'a>>,
}

impl<'a> Scenes<'a> {
    /// Returns the catalogue's scenes and `model`, if given.
    pub fn new(model: Option<Entry<'a>>) -> Self {
        Self { model }
    }

    /// Returns all scenes, in order.
    pub fn all(&self) -> impl Iterator<Item = Entry<'a>> + use<'a> {
        CATALOGUE.iter().copied().chain(self.model)
    }

    /// Returns the scene to begin with: the model, or the ball.
    pub fn default(&self) -> Entry<'a> {
        self.model.unwrap_or(CATALOGUE[0])
    }

    /// Returns the scene with a name.
    fn named(&self, name: &str) -> Option<Entry<'a>> {
        self.all().find(|entry| entry.name == name)
    }

    /// Returns the scene after `entry`; after the last comes the first.
    fn after(&self, entry: &Entry<'a>) -> Entry<'a> {
        let mut rest = self.all().skip_while(|known| known.name != entry.name);
        rest.nth(1).unwrap_or(CATALOGUE[0])
    }
}

/// The state that a frame depends on, besides its tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State<'a> {
    /// The scenes to choose from.
    pub scenes: Scenes<'a>,
    /// The current scene.
    pub entry: Entry<'a>,
    /// The mapper of the scene's textures.
    pub mapper: Mapper,
    /// The order in which spans are drawn.
    pub order: Order,
    /// Whether faces are drawn in reduced quality where motion hides it.
    pub lower: bool,
    motion: Motion,
}

/// The error that a name is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unknown;

impl<'a> State<'a> {
    /// Returns the state of a scene with its own motion and the default settings.
    pub fn of(scenes: Scenes<'a>, entry: Entry<'a>) -> Self {
        Self {
            scenes,
            entry,
            mapper: Mapper::default(),
            order: Order::default(),
            lower: false,
            motion: Motion::OWN,
        }
    }

    /// Returns the same settings with the scene's own motion.
    pub fn unsteered(&self) -> Self {
        Self {
            motion: Motion::OWN,
            ..*self
        }
    }

    /// Returns the pose at a tick. The tick is not before the last change.
    pub fn pose(&self, tick: u32) -> Pose {
        self.motion.at(tick).pose(&self.entry)
    }

    /// Returns the pose at the next tick, as a continuation of the pose at `tick`: without a jump where tiles
    /// repeat.
    pub fn next_pose(&self, tick: u32) -> Pose {
        let next = self.pose(tick.wrapping_add(1));
        self.entry.following(&self.pose(tick), next)
    }

    /// Returns whether all motion is paused.
    pub fn is_paused(&self) -> bool {
        self.motion.paused
    }

    /// Applies a change at a tick, which is not before the last change. Returns whether the state changed.
    ///
    /// # Errors
    /// The name is unknown. The state did not change.
    pub fn change(&mut self, tick: u32, change: &Change) -> Result<bool, Unknown> {
        let mut next = *self;
        match change {
            Change::Act(action) => next.act(tick, *action),
            Change::Set(setting, name) => next.set(*setting, name)?,
        }
        let changed = next.differs(self, tick);
        if changed {
            *self = next;
        }
        Ok(changed)
    }

    fn differs(&self, other: &Self, tick: u32) -> bool {
        self.entry.name != other.entry.name
            || (self.mapper, self.order, self.lower) != (other.mapper, other.order, other.lower)
            || self.motion.at(tick) != other.motion.at(tick)
    }

    fn act(&mut self, tick: u32, action: Action) {
        self.motion = self.motion.at(tick);
        let (motion, entry) = (&mut self.motion, self.entry);
        match action {
            // With a positive yaw the side towards the viewer moves to the left, with a positive pitch it
            // moves down, and with a positive roll the top moves to the right.
            Action::YawLeft => motion.push(0, 1),
            Action::YawRight => motion.push(0, -1),
            Action::PitchUp => motion.push(1, -1),
            Action::PitchDown => motion.push(1, 1),
            Action::RollLeft => motion.push(2, -1),
            Action::RollRight => motion.push(2, 1),
            Action::Faster => motion.faster(),
            Action::Slower => motion.slower(),
            Action::Stop => motion.stop(),
            Action::Pause => motion.paused = !motion.paused,
            Action::Step if motion.paused => *motion = motion.after(1),
            Action::Step => motion.paused = true,
            Action::Nearer => motion.approach(-STEP, &entry),
            Action::Farther => motion.approach(STEP, &entry),
            Action::NextScene => {
                let next = self.scenes.after(&entry);
                self.put(next);
            }
            Action::NextMapper => self.mapper = neighbour(self.mapper, 1),
            Action::LastMapper => self.mapper = neighbour(self.mapper, Mapper::ALL.len() - 1),
            Action::Finer => self.mapper = within(self.mapper, Tolerance::half),
            Action::Coarser => self.mapper = within(self.mapper, Tolerance::double),
            Action::NextOrder => {
                let here = Order::ALL
                    .iter()
                    .position(|(_, order, _)| *order == self.order);
                let next = here.map_or(0, |here| (here + 1) % Order::ALL.len());
                self.order = Order::ALL[next].1;
            }
            Action::Quality => self.lower = !self.lower,
            Action::Reset => *self = Self::of(self.scenes, entry),
            Action::Help | Action::Info | Action::Split | Action::Hint => {}
        }
    }

    fn set(&mut self, setting: Setting, name: &Word) -> Result<(), Unknown> {
        let name = name.as_str();
        match setting {
            Setting::Scene => self.put(self.scenes.named(name).ok_or(Unknown)?),
            Setting::Mapper => self.mapper = Mapper::parse(name).ok_or(Unknown)?,
            Setting::Order => self.order = Order::parse(name).ok_or(Unknown)?,
        }
        Ok(())
    }

    /// Changes the scene. A different scene starts with its own motion.
    fn put(&mut self, entry: Entry<'a>) {
        if entry.name != self.entry.name {
            self.entry = entry;
            self.motion = Motion::OWN;
        }
    }
}

/// Returns the mapper `steps` further on in the list, which wraps. A tolerance that is not in the list counts
/// as the first tolerance in the list.
fn neighbour(mapper: Mapper, steps: usize) -> Mapper {
    let listed = |(_, known, _): &(_, Mapper, _)| match (mapper.name(), mapper, *known) {
        ("", Mapper::Within(_), Mapper::Within(_)) => true,
        _ => *known == mapper,
    };
    let here = Mapper::ALL.iter().position(listed).unwrap_or(0);
    Mapper::ALL[(here + steps) % Mapper::ALL.len()].1
}

/// Returns `within-T` with its tolerance changed by `other`, if the result is legal; for any other mapper,
/// `within-1`.
fn within(mapper: Mapper, other: fn(Tolerance) -> Option<Tolerance>) -> Mapper {
    match mapper {
        Mapper::Within(tolerance) => Mapper::Within(other(tolerance).unwrap_or(tolerance)),
        _ => Mapper::Within(Tolerance::TEXEL),
    }
}

/// A change and its tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noted {
    tick: u32,
    change: Change,
}

impl Noted {
    /// An unused entry. It is all zeros, so that an empty log occupies no space in the kernel's image.
    const NONE: Self = Self {
        tick: 0,
        change: Change::Act(Action::YawLeft),
    };
}

/// Memory for a log's changes.
pub(crate) type Notes = [Noted; Log::MAX];

/// A log: a known state, and the changes since, with their ticks.
#[derive(Debug)]
pub(crate) struct Log<'a> {
    /// The state before the first change.
    start: State<'a>,
    notes: &'a mut Notes,
    len: usize,
    /// Changes that were made and did not fit in the log.
    lost: u32,
}

/// Why a change is not logged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NotNoted {
    /// Its tick is before the tick of the last change, which is this.
    Before(u32),
    /// The log is full.
    Full,
}

impl<'a> Log<'a> {
    /// Most changes. A push at its limit changes nothing and is not logged, so even a person who never stops
    /// pressing keys adds only some hundred a minute.
    pub const MAX: usize = 1024;

    /// Memory for an empty log, all zeros.
    pub const NOTES: Notes = [Noted::NONE; Self::MAX];

    /// Returns a log without changes since `start`.
    pub fn new(start: State<'a>, notes: &'a mut Notes) -> Self {
        let (len, lost) = (0, 0);
        Self {
            start,
            notes,
            len,
            lost,
        }
    }

    /// Discards all changes and starts again with `start`.
    pub fn restart(&mut self, start: State<'a>) {
        (self.start, self.len, self.lost) = (start, 0, 0);
    }

    /// Returns the state before the first change.
    pub fn start(&mut self) -> &mut State<'a> {
        &mut self.start
    }

    /// Returns the changes with their ticks, which never decrease.
    pub fn changes(&self) -> impl Iterator<Item = (u32, &Change)> {
        self.notes[..self.len]
            .iter()
            .map(|noted| (noted.tick, &noted.change))
    }

    /// Returns how many changes were made and did not fit in the log.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Logs a change.
    ///
    /// # Errors
    /// The tick is before that of the last change, or the log is full.
    pub fn note(&mut self, tick: u32, change: Change) -> Result<(), NotNoted> {
        let last = self.changes().last().map(|(tick, _)| tick);
        if let Some(last) = last.filter(|&last| tick < last) {
            return Err(NotNoted::Before(last));
        }
        let place = self.notes.get_mut(self.len).ok_or(NotNoted::Full)?;
        *place = Noted { tick, change };
        self.len += 1;
        Ok(())
    }

    /// Logs a change that was made, or counts it as lost if that fails. It also fails when the tick counter
    /// wraps, after 828 days.
    pub fn keep(&mut self, tick: u32, change: Change) {
        if self.note(tick, change).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// Returns the state at a tick, or `None` if earlier changes were lost.
    pub fn state(&self, tick: u32) -> Option<State<'a>> {
        let mut state = self.start;
        for (noted, change) in self.changes() {
            if tick < noted {
                return Some(state);
            }
            // A change with an unknown name is never logged.
            let _ = state.change(noted, change);
        }
        (self.lost == 0).then_some(state)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use scene::Mesh;
    use scene::catalogue::Colours;
    use std::boxed::Box;
    use std::vec::Vec;
    use texmap::Texture;

    /// Returns the state of a catalogue's scene with its own motion.
    fn own(number: usize) -> State<'static> {
        State::of(Scenes::new(None), CATALOGUE[number])
    }

    fn act(state: &mut State<'_>, tick: u32, action: Action) -> bool {
        state.change(tick, &Change::Act(action)).unwrap()
    }

    fn any(random: &mut fastrand::Rng) -> Action {
        Action::ALL[random.usize(..Action::ALL.len())].1
    }

    #[test]
    fn a_show_that_is_not_steered_is_the_scenes_own() {
        for (number, entry) in CATALOGUE.iter().enumerate() {
            let state = own(number);
            for tick in [0, 1, 720, u32::MAX] {
                assert_eq!(state.pose(tick), entry.pose(tick));
            }
        }
    }

    /// Moving the starting point to any tick changes no later pose.
    #[test]
    fn a_pose_does_not_depend_on_when_it_was_looked_at() {
        let mut random = seeded::generator();
        for _ in 0..200 {
            let mut state = own(random.usize(..CATALOGUE.len()));
            let mut tick = random.u32(..);
            for _ in 0..random.usize(..30) {
                act(&mut state, tick, any(&mut random));
                tick = tick.wrapping_add(random.u32(..100));
            }
            let mut looked = state;
            let end = tick.wrapping_add(1000);
            while tick != end {
                looked.motion = looked.motion.at(tick);
                tick = tick.wrapping_add(1);
            }
            assert_eq!(looked.pose(end), state.pose(end));
        }
    }

    #[test]
    fn keys_held_down_stay_in_the_legal_ranges_and_come_to_nothing_more() {
        for (_, action) in Action::ALL {
            let mut state = own(0);
            let toggles = matches!(
                action,
                Action::Pause
                    | Action::Step
                    | Action::NextScene
                    | Action::NextMapper
                    | Action::LastMapper
                    | Action::NextOrder
                    | Action::Quality
            );
            for tick in 0..3000 {
                let changed = act(&mut state, tick, action);
                assert!(!changed || tick < 2999 || toggles, "{action} goes on");
                let pose = state.pose(tick);
                assert!((0..=Pose::MAX_DISTANCE).contains(&pose.distance));
            }
        }
        let mut random = seeded::generator();
        let mut state = own(0);
        for tick in 0..20_000 {
            act(&mut state, tick, any(&mut random));
            let pose = state.pose(tick + random.u32(..1000));
            assert!((0..=Pose::MAX_DISTANCE).contains(&pose.distance));
        }
    }

    /// Checks where the nearest point of the ball moves, and for a roll its top.
    #[test]
    fn each_turn_goes_the_way_of_its_name() {
        const UNIT: i32 = 1 << 16;
        for (action, point, [x, y]) in [
            (Action::YawLeft, [0, 0, -UNIT], [-1, 0]),
            (Action::YawRight, [0, 0, -UNIT], [1, 0]),
            (Action::PitchUp, [0, 0, -UNIT], [0, -1]),
            (Action::PitchDown, [0, 0, -UNIT], [0, 1]),
            (Action::RollLeft, [0, -UNIT, 0], [-1, 0]),
            (Action::RollRight, [0, -UNIT, 0], [1, 0]),
        ] {
            let mut motion = Motion::OWN;
            motion.stop();
            let mut state = own(0);
            state.motion = motion;
            act(&mut state, 0, action);
            let level = Pose {
                yaw: 0,
                pitch: 0,
                roll: 0,
                distance: 4 * UNIT,
            };
            let turned = state.motion.at(10).steered(level);
            let [to_x, to_y, _] = turned.orientation().turn(point);
            let near = |to: i32, from: i32| {
                if (to - from).abs() < 300 {
                    0
                } else {
                    (to - from).signum()
                }
            };
            assert_eq!(
                [near(to_x, point[0]), near(to_y, point[1])],
                [x, y],
                "{action}"
            );
        }
    }

    #[test]
    fn faster_and_slower_are_each_others_opposite_and_stop_is_still() {
        let mut state = own(0);
        let speed =
            |state: &State<'_>| state.pose(800).yaw.wrapping_sub(state.pose(720).yaw) as i32;
        let normal = speed(&state);
        for _ in 0..4 {
            act(&mut state, 0, Action::Faster);
        }
        assert_eq!(speed(&state), 2 * normal);
        for _ in 0..8 {
            act(&mut state, 0, Action::Slower);
        }
        // An odd number of ticks at half the speed: halfway between two of the scene's own poses.
        let slow = state.pose(801).yaw.wrapping_sub(state.pose(800).yaw) as i32;
        assert!((slow - normal / 80 / 2).abs() < 4, "{slow}");
        act(&mut state, 900, Action::Stop);
        assert_eq!(state.pose(900), state.pose(5000));
        assert!(!act(&mut state, 5000, Action::Slower));
        act(&mut state, 5000, Action::Faster);
        assert_eq!(
            speed(&State {
                motion: state.motion.starting(0),
                ..state
            }),
            normal
        );
    }

    /// At any speed, the motion along tiles continues smoothly where the tiles repeat: no interpolated pose
    /// lies behind its neighbours, and no two consecutive poses are a tile apart.
    #[test]
    fn a_walk_has_no_leap_at_a_tile_s_end() {
        let mut state = own(0);
        while state.entry.name != "corridor" {
            act(&mut state, 0, Action::NextScene);
        }
        act(&mut state, 0, Action::Faster);
        for tick in 0..400 {
            let (here, next) = (state.pose(tick).distance, state.next_pose(tick).distance);
            assert!(
                (1000..2000).contains(&(here - next)),
                "{tick}: {here} to {next}"
            );
            let shown = state.pose(tick + 1).distance;
            assert!(
                shown == next || shown == next + (1 << 16),
                "{tick}: {shown}"
            );
        }
    }

    #[test]
    fn a_pause_stands_and_steps_by_ticks() {
        let mut state = own(0);
        let running = state;
        act(&mut state, 100, Action::Pause);
        assert_eq!(state.pose(200), running.pose(100));
        act(&mut state, 200, Action::Step);
        act(&mut state, 300, Action::Step);
        assert_eq!(state.pose(400), running.pose(102));
        act(&mut state, 500, Action::Pause);
        assert_eq!(state.pose(501), running.pose(103));
    }

    #[test]
    fn settings_go_around_and_tolerances_to_their_ends() {
        let mut state = own(0);
        let (mapper, order, scene) = (state.mapper, state.order, state.entry.name);
        for _ in 0..Mapper::ALL.len() {
            act(&mut state, 0, Action::NextMapper);
        }
        for _ in 0..Order::ALL.len() {
            act(&mut state, 0, Action::NextOrder);
        }
        for _ in 0..CATALOGUE.len() {
            act(&mut state, 0, Action::NextScene);
        }
        assert_eq!(
            (state.mapper, state.order, state.entry.name),
            (mapper, order, scene)
        );
        act(&mut state, 0, Action::NextMapper);
        act(&mut state, 0, Action::LastMapper);
        assert_eq!(state.mapper, mapper);
        let mut names = Vec::new();
        for action in [Action::Finer, Action::Coarser] {
            for _ in 0..40 {
                act(&mut state, 0, action);
            }
            names.push(std::format!("{}", state.mapper));
        }
        assert_eq!(names, ["within-1/65536", "within-256"]);
        // A tolerance that is not in the list still has neighbours.
        act(&mut state, 0, Action::NextMapper);
        assert_eq!(state.mapper.name(), "within-1/2");
    }

    /// A loaded model is the first scene, and the last one in the list.
    #[test]
    fn a_model_is_a_scene_among_the_others() {
        let mesh = Mesh {
            vertices: &[],
            corners: &[],
            faces: &[],
            convex: true,
        };
        let model = Entry::loaded(mesh, Texture::DOT, Colours::BUILT_IN, &[0; modex::HEIGHT]);
        let scenes = Scenes::new(Some(model));
        let mut state = State::of(scenes, scenes.default());
        assert_eq!(state.entry.name, Entry::LOADED);
        for entry in CATALOGUE {
            act(&mut state, 0, Action::NextScene);
            assert_eq!(state.entry.name, entry.name);
        }
        act(&mut state, 0, Action::NextScene);
        assert_eq!(state.entry.name, Entry::LOADED);
        act(&mut state, 0, Action::Reset);
        assert_eq!(state.entry.name, Entry::LOADED);
        let by_name = Change::Set(Setting::Scene, Word::new(Entry::LOADED).unwrap());
        assert_eq!(own(0).change(0, &by_name), Err(Unknown));
    }

    #[test]
    fn a_log_knows_the_state_at_every_tick_until_it_is_full() {
        let mut random = seeded::generator();
        let mut notes = Box::new(Log::NOTES);
        let start = own(0);
        let mut log = Log::new(start, &mut notes);
        let (mut state, mut tick, mut poses) = (start, 0, Vec::new());
        while log.changes().count() < Log::MAX {
            let action = any(&mut random);
            if action != Action::NextScene && act(&mut state, tick, action) {
                log.keep(tick, Change::Act(action));
            }
            if random.bool() {
                poses.push((tick, state.pose(tick)));
                tick += random.u32(1..5);
            }
        }
        for (tick, pose) in &poses {
            assert_eq!(log.state(*tick).unwrap().pose(*tick), *pose, "at {tick}");
        }
        assert!(log.state(tick).is_some());
        let stop = Change::Act(Action::Stop);
        assert!(matches!(log.note(0, stop), Err(NotNoted::Before(last)) if last <= tick));
        assert_eq!(log.note(tick, stop), Err(NotNoted::Full));
        log.keep(tick, stop);
        assert_eq!(log.lost(), 1);
        assert!(log.state(tick).is_none() && log.state(0).is_some());
        log.restart(start);
        assert_eq!((log.lost(), log.changes().count()), (0, 0));
    }
}
