//! Worlds by the number: obstacles thrown on the floor until a way is left.

use super::{
    DISTANCE, Footprint, LOWEST_OBSTACLE, NARROWEST, Obstacle, ROBOT_RADIUS, Tiles, WIDE, World,
};
use crate::Ground;
use wheatstone_numeric::random::Random;

/// Random numbers of worlds have their own stream.
const STREAM: u64 = 0x0b57_ac1e;

/// Free floor about the start and the goal, in centimetres from their middles: the robot has not seen
/// what stands beside it when it sets out.
const CLEAR: f64 = ROBOT_RADIUS + 28.0;

/// Simple worlds have another.
const SIMPLE_STREAM: u64 = 0x51_3b1e;

/// Obstacles of a simple world, at least; two more at most.
const FEW: usize = 2;

/// Half the side of a simple world's boxes, in centimetres.
const BOX: [f64; 2] = [8.0, 14.0];

pub(super) fn world(seed: u64) -> World {
    let mut random = Random::stream(seed, STREAM);
    loop {
        let world = attempt(seed, &mut random);
        if world.obstacles.len() >= 6 && has_way(&world, NARROWEST) {
            return world;
        }
    }
}

pub(super) fn simple(seed: u64) -> World {
    let mut random = Random::stream(seed, SIMPLE_STREAM);
    loop {
        let mut world = bare(seed, &mut random);
        let count = FEW + random.below(3);
        for _ in 0..200 {
            if world.obstacles.len() < count {
                let thrown = square_box(&world, &mut random);
                let wide = world.clearance(thrown.centre.into()) > thrown.reach() + WIDE;
                let fits = wide && spares_ends(&world, &thrown);
                world.obstacles.extend(fits.then_some(thrown));
            }
        }
        if world.obstacles.len() >= FEW && has_way(&world, WIDE) {
            return world;
        }
    }
}

fn attempt(seed: u64, random: &mut Random) -> World {
    let mut world = bare(seed, random);
    let count = 6 + random.below(7);
    if random.below(2) == 0 {
        gate(&mut world, random);
    }
    // Where the floor is full, what was thrown last stays out.
    for _ in 0..2000 {
        if world.obstacles.len() >= count {
            break;
        }
        let thrown = obstacle(&world, random);
        if fits(&world, &thrown) {
            world.obstacles.push(thrown);
        }
    }
    world
}

/// Walls, tiles and a goal; nothing stands on the floor.
fn bare(seed: u64, random: &mut Random) -> World {
    // Within what the robot observes of the direction in which it is set down.
    let bearing = random.uniform(-0.35, 0.35);
    let goal = [DISTANCE * libm::sin(bearing), DISTANCE * libm::cos(bearing)];
    let walls = [
        -random.uniform(85.0, 130.0) + goal[0].min(0.0),
        random.uniform(85.0, 130.0) + goal[0].max(0.0),
        -random.uniform(55.0, 80.0),
        goal[1] + random.uniform(55.0, 80.0),
    ];
    let dark_and_light = [random.uniform(0.38, 0.44), random.uniform(0.54, 0.60)];
    let tiles = Tiles {
        side: random.uniform(16.0, 25.0),
        turn: random.uniform(0.0, std::f64::consts::FRAC_PI_2),
        corner: [random.uniform(0.0, 30.0), random.uniform(0.0, 30.0)],
        shades: dark_and_light,
    };
    let panels =
        ([random.uniform(0.06, 0.16), random.uniform(0.80, 0.92)], random.uniform(30.0, 45.0));
    let wall_height = random.uniform(50.0, 70.0);
    World { seed, walls, wall_height, panels, tiles, obstacles: Vec::new(), goal }
}

/// Two long boxes on the straight way, with a narrow gap between them.
fn gate(world: &mut World, random: &mut Random) {
    let gap = NARROWEST * random.uniform(1.0, 1.5);
    let along = random.uniform(110.0, 190.0) / DISTANCE;
    let aside = random.uniform(-25.0, 25.0);
    let turn = libm::atan2(world.goal[0], world.goal[1]) + random.uniform(-0.25, 0.25);
    let deep = random.uniform(8.0, 30.0);
    for side in [-1.0, 1.0] {
        let half = [random.uniform(18.0, 32.0), deep];
        let off = side * (gap / 2.0 + half[0]);
        let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
        let centre = [
            world.goal[0] * along + (aside + off) * cosine,
            world.goal[1] * along - (aside + off) * sine,
        ];
        let mut made = obstacle(world, random);
        made.footprint = Footprint::Box(half);
        made.centre = centre;
        made.turn = turn;
        world.obstacles.push(made);
    }
}

fn obstacle(world: &World, random: &mut Random) -> Obstacle {
    let footprint = if random.below(5) < 3 {
        Footprint::Box([random.uniform(6.0, 20.0), random.uniform(6.0, 20.0)])
    } else {
        Footprint::Cylinder(random.uniform(6.0, 14.0))
    };
    let [left, right, behind, ahead] = world.walls;
    let dark = random.uniform(0.05, 0.20);
    let light = random.uniform(0.80, 0.95);
    let (front, side) = if random.below(2) == 0 { (dark, light) } else { (light, dark) };
    let top =
        if random.below(2) == 0 { random.uniform(0.22, 0.28) } else { random.uniform(0.70, 0.76) };
    Obstacle {
        footprint,
        centre: [random.uniform(left, right), random.uniform(behind, ahead)],
        turn: random.uniform(0.0, std::f64::consts::PI),
        height: random.uniform(LOWEST_OBSTACLE, 45.0),
        shades: [front, side, top],
    }
}

/// A square box, black or white all round, with its sides along the way to the goal, on which it stands or
/// near it.
fn square_box(world: &World, random: &mut Random) -> Obstacle {
    let half = random.uniform(BOX[0], BOX[1]);
    let (along, aside) = (random.uniform(0.0, 1.0), random.uniform(-70.0, 70.0));
    let turn = libm::atan2(world.goal[0], world.goal[1]);
    let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
    let shade = if random.below(2) == 0 { 0.08 } else { 0.92 };
    // Top and sides are lit otherwise: their edge shows.
    let top = if shade < 0.5 { 0.25 } else { 0.73 };
    Obstacle {
        footprint: Footprint::Box([half, half]),
        centre: [world.goal[0] * along + aside * cosine, world.goal[1] * along - aside * sine],
        turn,
        height: random.uniform(25.0, 45.0),
        shades: [shade, shade, top],
    }
}

/// Whether an obstacle stands within the walls, clear of start and goal, and not in another.
fn fits(world: &World, thrown: &Obstacle) -> bool {
    let centre = Ground::from(thrown.centre);
    let [left, right, behind, ahead] = world.walls;
    let reach = thrown.reach();
    let within = centre.x - reach > left
        && centre.x + reach < right
        && centre.y - reach > behind
        && centre.y + reach < ahead;
    let alone = world.obstacles.iter().all(|other| other.distance(centre) > reach + 2.0);
    within && alone && spares_ends(world, thrown)
}

/// Whether an obstacle leaves the floor about the start and the goal free.
fn spares_ends(world: &World, thrown: &Obstacle) -> bool {
    [Ground::origin(), world.goal()].iter().all(|end| thrown.distance(*end) > CLEAR)
}

/// Whether a disc so wide gets from the start to the goal: a flood over a raster.
fn has_way(world: &World, width: f64) -> bool {
    // Gaps are met to a few millimetres.
    const STEP: f64 = 2.0;
    let [left, right, behind, ahead] = world.walls;
    let (columns, rows) =
        (((right - left) / STEP) as usize + 1, ((ahead - behind) / STEP) as usize + 1);
    let place = |column: usize, row: usize| {
        Ground::new(left + column as f64 * STEP, behind + row as f64 * STEP)
    };
    let cell = |at: Ground| {
        [((at.x - left) / STEP).round() as usize, ((at.y - behind) / STEP).round() as usize]
    };
    // A gap of the raster's width on each side of the line of its cells still lets the robot pass.
    let open = |column, row| world.clearance(place(column, row)) >= width / 2.0 - 0.5 * STEP;
    let goal = cell(world.goal());
    let mut seen = vec![false; columns * rows];
    let mut open_ends = vec![cell(Ground::origin())];
    while let Some([column, row]) = open_ends.pop() {
        if column >= columns || row >= rows || seen[row * columns + column] || !open(column, row) {
            continue;
        }
        if [column, row] == goal {
            return world.clearance(world.goal()) >= CLEAR
                && world.clearance(Ground::origin()) >= CLEAR;
        }
        seen[row * columns + column] = true;
        open_ends.push([column + 1, row]);
        open_ends.push([column.wrapping_sub(1), row]);
        open_ends.push([column, row + 1]);
        open_ends.push([column, row.wrapping_sub(1)]);
    }
    false
}
