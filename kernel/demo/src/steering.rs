//! Steering: the state that a running demo's frames depend on, and its changes.
//!
//! A frame is a function of a [`State`] and a tick, and a state changes only at ticks. So the changes and
//! their ticks, which the [`Log`](crate::log::Log) stores, define every frame: the log gives the same frames
//! again on any machine, however many ticks that machine skips.

use core::fmt;

use protocol::{Action, Change, Setting, Word};
use scene::Pose;
use scene::catalogue::{CATALOGUE, Entry};
use texmap::{Mapper, Order, Tolerance};

use crate::trajectory::Trajectory;

/// The change of distance in one step, 16.16: 1/16 unit.
const STEP: i32 = 1 << 12;

/// The available scenes, by number: the catalogue's, then the loaded model if one exists.
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
    pub fn all(&self) -> impl Iterator<Item = &Entry<'a>> {
        CATALOGUE.iter().chain(&self.model)
    }

    /// Returns how many scenes exist.
    fn count(&self) -> usize {
        CATALOGUE.len() + usize::from(self.model.is_some())
    }

    /// Returns the number of the scene to begin with: the model, or the ball.
    pub fn default(&self) -> usize {
        match self.model {
            Some(_) => CATALOGUE.len(),
            None => 0,
        }
    }

    /// Returns a scene by its number.
    fn entry(&self, number: usize) -> &Entry<'a> {
        match &self.model {
            Some(model) if number == CATALOGUE.len() => model,
            _ => &CATALOGUE[number],
        }
    }

    /// Resolves a change's name.
    ///
    /// # Errors
    /// If the name is unknown.
    pub fn resolve(&self, change: Change) -> Result<StateChange, UnknownName> {
        let (setting, name) = match change {
            Change::Act(action) => return Ok(StateChange::Act(action)),
            Change::Set(setting, name) => (setting, name),
        };
        let text = name.as_str();
        let resolved = match setting {
            Setting::Scene => {
                let number = self.all().position(|entry| entry.name == text);
                number.map(StateChange::Scene)
            }
            Setting::Mapper => Mapper::parse(text).map(StateChange::Mapper),
            Setting::Order => Order::parse(text).map(StateChange::Order),
        };
        resolved.ok_or(UnknownName(setting, name))
    }

    /// Displays a change as `steer` accepts it.
    pub fn display(&self, change: StateChange) -> impl fmt::Display {
        fmt::from_fn(move |f| match change {
            StateChange::Act(action) => write!(f, "{action}"),
            StateChange::Scene(number) => {
                write!(f, "{} {}", Setting::Scene, self.entry(number).name)
            }
            StateChange::Mapper(mapper) => write!(f, "{} {mapper}", Setting::Mapper),
            StateChange::Order(order) => write!(f, "{} {order}", Setting::Order),
        })
    }
}

/// The error of a name that no value of a setting has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct UnknownName(pub Setting, pub Word);

/// A [`Change`] whose name is resolved.
///
/// `repr(u8)` keeps the tag in a byte before the payload, so a change to [`Action::YawLeft`] is all zeros. An
/// empty log then occupies no space in the kernel's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum StateChange {
    Act(Action),
    /// The number of a scene in [`Scenes`].
    Scene(usize),
    Mapper(Mapper),
    Order(Order),
}

/// The state that a frame depends on, besides its tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State<'a> {
    /// The scenes to choose from.
    pub scenes: Scenes<'a>,
    /// The number of the current scene.
    pub scene: usize,
    /// The mapper of the scene's textures.
    pub mapper: Mapper,
    /// The order in which spans are drawn.
    pub order: Order,
    /// Whether faces are drawn in reduced quality where motion hides it.
    pub reduced_quality: bool,
    trajectory: Trajectory,
}

impl<'a> State<'a> {
    /// Returns the state of a scene with its own motion and the default settings.
    pub fn new(scenes: Scenes<'a>, scene: usize) -> Self {
        Self {
            scenes,
            scene,
            mapper: Mapper::default(),
            order: Order::default(),
            reduced_quality: false,
            trajectory: Trajectory::UNSTEERED,
        }
    }

    /// Returns the same settings with the scene's own motion.
    pub fn unsteered(&self) -> Self {
        Self {
            trajectory: Trajectory::UNSTEERED,
            ..*self
        }
    }

    /// Returns the current scene.
    pub fn entry(&self) -> &Entry<'a> {
        self.scenes.entry(self.scene)
    }

    /// Returns the pose at a tick. The tick is not before the last change.
    pub fn pose(&self, tick: u32) -> Pose {
        self.trajectory.at(tick).pose(self.entry())
    }

    /// Returns the pose at the next tick, as a continuation of the pose at `tick`: without a jump where tiles
    /// repeat.
    pub fn next_pose(&self, tick: u32) -> Pose {
        let next = self.pose(tick.wrapping_add(1));
        self.entry().following(&self.pose(tick), next)
    }

    /// Returns whether all motion is paused.
    pub fn is_paused(&self) -> bool {
        self.trajectory.paused
    }

    /// Applies a change at a tick, which is not before the last change. Returns whether the state changed.
    pub fn apply(&mut self, tick: u32, change: StateChange) -> bool {
        let mut next = *self;
        match change {
            StateChange::Act(action) => next.act(tick, action),
            StateChange::Scene(number) => next.set_scene(number),
            StateChange::Mapper(mapper) => next.mapper = mapper,
            StateChange::Order(order) => next.order = order,
        }
        let changed = next.differs(self, tick);
        if changed {
            *self = next;
        }
        changed
    }

    fn differs(&self, other: &Self, tick: u32) -> bool {
        let settings = |state: &Self| {
            let Self {
                scene,
                mapper,
                order,
                reduced_quality,
                ..
            } = *state;
            (scene, mapper, order, reduced_quality)
        };
        settings(self) != settings(other) || self.trajectory.at(tick) != other.trajectory.at(tick)
    }

    fn act(&mut self, tick: u32, action: Action) {
        self.trajectory = self.trajectory.at(tick);
        let entry = self.scenes.entry(self.scene);
        let trajectory = &mut self.trajectory;
        match action {
            // With a positive yaw the side towards the viewer moves to the left, with a positive pitch it
            // moves down, and with a positive roll the top moves to the right.
            Action::YawLeft => trajectory.push(0, 1),
            Action::YawRight => trajectory.push(0, -1),
            Action::PitchUp => trajectory.push(1, -1),
            Action::PitchDown => trajectory.push(1, 1),
            Action::RollLeft => trajectory.push(2, -1),
            Action::RollRight => trajectory.push(2, 1),
            Action::Faster => trajectory.faster(),
            Action::Slower => trajectory.slower(),
            Action::Stop => trajectory.stop(),
            Action::Pause => trajectory.paused = !trajectory.paused,
            Action::Step if trajectory.paused => *trajectory = trajectory.after(1),
            Action::Step => trajectory.paused = true,
            Action::Nearer => trajectory.approach(-STEP, entry),
            Action::Farther => trajectory.approach(STEP, entry),
            Action::NextScene => self.set_scene((self.scene + 1) % self.scenes.count()),
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
            Action::Quality => self.reduced_quality = !self.reduced_quality,
            Action::Reset => *self = Self::new(self.scenes, self.scene),
            Action::Help | Action::Info | Action::Split | Action::Hint => {}
        }
    }

    /// Changes the scene. A different scene starts with its own motion.
    fn set_scene(&mut self, number: usize) {
        if number != self.scene {
            self.scene = number;
            self.trajectory = Trajectory::UNSTEERED;
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

#[cfg(test)]
pub(crate) mod tests {
    extern crate std;
    use super::*;
    use scene::Mesh;
    use scene::catalogue::Colours;
    use std::vec::Vec;
    use texmap::Texture;

    /// Returns the state of a catalogue's scene with its own motion.
    pub(crate) fn state_of(number: usize) -> State<'static> {
        State::new(Scenes::new(None), number)
    }

    fn act(state: &mut State<'_>, tick: u32, action: Action) -> bool {
        state.apply(tick, StateChange::Act(action))
    }

    pub(crate) fn any_action(random: &mut fastrand::Rng) -> Action {
        Action::ALL[random.usize(..Action::ALL.len())]
    }

    #[test]
    fn without_steering_a_pose_is_the_scene_s() {
        for (number, entry) in CATALOGUE.iter().enumerate() {
            let state = state_of(number);
            for tick in [0, 1, 720, u32::MAX] {
                assert_eq!(state.pose(tick), entry.pose(tick));
            }
        }
    }

    /// Moving the starting point to any tick changes no later pose.
    #[test]
    fn a_pose_does_not_depend_on_the_starting_point() {
        let mut random = seeded::generator();
        for _ in 0..200 {
            let mut state = state_of(random.usize(..CATALOGUE.len()));
            let mut tick = random.u32(..);
            for _ in 0..random.usize(..30) {
                act(&mut state, tick, any_action(&mut random));
                tick = tick.wrapping_add(random.u32(..100));
            }
            let mut moved = state;
            let end = tick.wrapping_add(1000);
            while tick != end {
                moved.trajectory = moved.trajectory.at(tick);
                tick = tick.wrapping_add(1);
            }
            assert_eq!(moved.pose(end), state.pose(end));
        }
    }

    #[test]
    fn a_repeated_action_stays_in_the_legal_range_and_ends() {
        for &action in Action::ALL {
            let mut state = state_of(0);
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
                assert!(
                    !changed || tick < 2999 || toggles,
                    "{action} still changes the state"
                );
                let pose = state.pose(tick);
                assert!((0..=Pose::MAX_DISTANCE).contains(&pose.distance));
            }
        }
        let mut random = seeded::generator();
        let mut state = state_of(0);
        for tick in 0..20_000 {
            act(&mut state, tick, any_action(&mut random));
            let pose = state.pose(tick + random.u32(..1000));
            assert!((0..=Pose::MAX_DISTANCE).contains(&pose.distance));
        }
    }

    /// Checks where the nearest point of the ball moves, and for a roll its top.
    #[test]
    fn each_turn_goes_in_the_direction_of_its_name() {
        const UNIT: i32 = 1 << 16;
        for (action, point, [x, y]) in [
            (Action::YawLeft, [0, 0, -UNIT], [-1, 0]),
            (Action::YawRight, [0, 0, -UNIT], [1, 0]),
            (Action::PitchUp, [0, 0, -UNIT], [0, -1]),
            (Action::PitchDown, [0, 0, -UNIT], [0, 1]),
            (Action::RollLeft, [0, -UNIT, 0], [-1, 0]),
            (Action::RollRight, [0, -UNIT, 0], [1, 0]),
        ] {
            let mut trajectory = Trajectory::UNSTEERED;
            trajectory.stop();
            let mut state = state_of(0);
            state.trajectory = trajectory;
            act(&mut state, 0, action);
            let level = Pose {
                yaw: 0,
                pitch: 0,
                roll: 0,
                distance: 4 * UNIT,
            };
            let turned = state.trajectory.at(10).steered(level);
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
    fn slower_undoes_faster_and_stop_stops_all_motion() {
        let mut state = state_of(0);
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
                trajectory: state.trajectory.starting(0),
                ..state
            }),
            normal
        );
    }

    /// At any speed, the motion along tiles continues smoothly where the tiles repeat: no interpolated pose
    /// lies behind its neighbours, and no two consecutive poses are a tile apart.
    #[test]
    fn a_motion_continues_smoothly_where_tiles_repeat() {
        let mut state = state_of(0);
        while state.entry().name != "corridor" {
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
    fn a_paused_pose_moves_only_by_steps() {
        let mut state = state_of(0);
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
    fn settings_wrap_and_tolerances_stop_at_their_limits() {
        let mut state = state_of(0);
        let (mapper, order, scene) = (state.mapper, state.order, state.scene);
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
            (state.mapper, state.order, state.scene),
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
    fn a_model_is_the_default_and_the_last_scene() {
        let mesh = Mesh {
            vertices: &[],
            corners: &[],
            faces: &[],
            convex: true,
        };
        let model = Entry::loaded(mesh, Texture::DOT, Colours::BUILT_IN, &[0; modex::HEIGHT]);
        let scenes = Scenes::new(Some(model));
        let mut state = State::new(scenes, scenes.default());
        assert_eq!(state.entry().name, Entry::LOADED);
        for entry in CATALOGUE {
            act(&mut state, 0, Action::NextScene);
            assert_eq!(state.entry().name, entry.name);
        }
        act(&mut state, 0, Action::NextScene);
        assert_eq!(state.entry().name, Entry::LOADED);
        act(&mut state, 0, Action::Reset);
        assert_eq!(state.entry().name, Entry::LOADED);
        let by_name = Change::Set(Setting::Scene, Word::new(Entry::LOADED).unwrap());
        assert_eq!(
            scenes.resolve(by_name),
            Ok(StateChange::Scene(CATALOGUE.len()))
        );
        assert!(Scenes::new(None).resolve(by_name).is_err());
    }

    #[test]
    fn a_change_is_displayed_as_it_was_requested() {
        let scenes = Scenes::new(None);
        for text in [
            "stop",
            "scene knot",
            "mapper exact",
            "mapper within-3/8",
            "order buffer",
        ] {
            let change = Change::parse(text.split(' ')).unwrap();
            let resolved = scenes.resolve(change).unwrap();
            assert_eq!(std::format!("{}", scenes.display(resolved)), text);
        }
    }
}
