//! Trajectories: the pose as a function of the tick.
//!
//! Each scene has its own motion: its pose at a time is [`Entry::pose`]. Steering lets that time pass faster
//! or slower, and adds a turn about each axis and a distance. Rates are integers per tick. A change first
//! accumulates the motion since the last change, and then becomes the new starting point. So nothing is
//! summed tick by tick, and no error grows.
//!
//! Keys repeat. The legal ranges bound what a repeated key can do, so holding a key down for an hour does no
//! more than holding it down for a minute.

use scene::Pose;
use scene::catalogue::Entry;

/// One (1.0), with 16 fraction bits.
const ONE: u32 = 1 << 16;
/// The rate that one push adds: 1/2880 turn a tick, a quarter of the ball's own rate.
const PUSH: i32 = ((1u64 << 32) / 2880) as i32;
/// Most pushes to one side: one turn in a second and a half.
const MAX_PUSHES: i32 = 32;
/// Most gears up or down. Four gears double the speed, so the range is 1/16 to 16 times.
const MAX_GEAR: i8 = 16;

/// The pose as a function of the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Trajectory {
    /// The tick of the last change. The other fields describe the pose and its rates at that tick.
    since: u32,
    /// The tick of the scene's own motion, with 16 fraction bits; 48 bits.
    scene_time: u64,
    /// Whether `scene_time` advances.
    scene_moves: bool,
    /// The turn that steering adds to yaw, pitch and roll, in 32-bit fractions of a turn.
    turn: [u32; 3],
    /// Pushes on each angle, which give its rate.
    pushes: [i32; 3],
    /// The distance that steering adds, 16.16.
    distance: i32,
    /// The speed of all motion: 2^(gear / 4) times.
    gear: i8,
    /// Whether all motion stands still, whatever the rates are.
    pub paused: bool,
}

impl Trajectory {
    /// The scene's own motion, without steering.
    pub const UNSTEERED: Self = Self {
        since: 0,
        scene_time: 0,
        scene_moves: true,
        turn: [0; 3],
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

    /// Returns the same trajectory, described from `tick` on.
    pub fn at(&self, tick: u32) -> Self {
        self.after(if self.paused {
            0
        } else {
            tick.wrapping_sub(self.since)
        })
        .starting(tick)
    }

    /// Returns the trajectory with another `since`, and everything else unchanged.
    pub fn starting(self, since: u32) -> Self {
        Self { since, ..self }
    }

    /// Returns the trajectory advanced by `ticks`, with the same `since`.
    pub fn after(&self, ticks: u32) -> Self {
        let mut after = *self;
        if self.scene_moves {
            let passed = u64::from(self.factor()) * u64::from(ticks);
            after.scene_time = self.scene_time.wrapping_add(passed) & ((1 << 48) - 1);
        }
        for (turn, rate) in after.turn.iter_mut().zip(self.rates()) {
            *turn = turn.wrapping_add((rate as u32).wrapping_mul(ticks));
        }
        after
    }

    /// Returns the pose at the tick `since`.
    pub fn pose(&self, entry: &Entry<'_>) -> Pose {
        let tick = (self.scene_time >> 16) as u32;
        let part = i64::from(self.scene_time as u32 % ONE);
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
    pub fn steered(&self, own: Pose) -> Pose {
        let [yaw, pitch, roll] = self.turn;
        Pose {
            yaw: own.yaw.wrapping_add(yaw),
            pitch: own.pitch.wrapping_add(pitch),
            roll: own.roll.wrapping_add(roll),
            distance: (own.distance + self.distance).clamp(0, Pose::MAX_DISTANCE),
        }
    }

    /// Pushes angle number `angle` once more to one side.
    pub fn push(&mut self, angle: usize, side: i32) {
        self.pushes[angle] = (self.pushes[angle] + side).clamp(-MAX_PUSHES, MAX_PUSHES);
    }

    /// Returns whether anything would move if the trajectory is not paused.
    fn moves(&self) -> bool {
        self.scene_moves || self.pushes != [0; 3]
    }

    /// Shifts all motion one gear up; starts the scene's own motion if nothing moves.
    pub fn faster(&mut self) {
        match self.moves() {
            true => self.gear = (self.gear + 1).min(MAX_GEAR),
            false => self.scene_moves = true,
        }
    }

    /// Shifts all motion one gear down.
    pub fn slower(&mut self) {
        if self.moves() {
            self.gear = (self.gear - 1).max(-MAX_GEAR);
        }
    }

    /// Stops the scene's own motion and all turns.
    pub fn stop(&mut self) {
        (self.scene_moves, self.pushes, self.gear) = (false, [0; 3], 0);
    }

    /// Changes the distance by `step`, as far as the pose stays legal.
    pub fn approach(&mut self, step: i32, entry: &Entry<'_>) {
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
