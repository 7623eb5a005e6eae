//! Captures drawn at random: other cameras, lenses, charts, placements, units and noise each time, so
//! that what is tried on them is tried on variety.

use super::{HandHeld, Noise, Rig};
use nalgebra::Matrix3;
use wheatstone_core::{
    camera::{
        AnyCamera, PosedCamera, brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt,
        pinhole::Pinhole,
    },
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Pose, Vector3},
};
use wheatstone_numeric::random::Random;

/// A capture with its truth.
#[derive(Clone, Debug)]
pub struct RandomCapture {
    /// The cameras.
    pub cameras: Vec<PosedCamera>,
    /// Where the chart stood: world from chart, a view.
    pub placements: Vec<Pose>,
    /// Points along the chart's x and y.
    pub counts: [usize; 2],
    /// Distance of neighbours.
    pub pitch: f64,
    /// For points at random places, which no two views share: by how much they lie off the chart's plane, as
    /// a share of its extent. `None` for a lattice.
    pub scattered: Option<f64>,
    /// Whether the chart was held by hand: a file has its places on the chart, and none in the world.
    pub held_by_hand: bool,
    /// The pixels' error.
    pub noise: Noise,
    /// The unit of lengths.
    pub unit: &'static str,
    /// Whether the rows have names, and whether they tell their view.
    pub named: [bool; 2],
    /// Share of points that a camera loses at random.
    pub lost: f64,
    /// The seed of noise and losses.
    pub seed: u64,
}

impl RandomCapture {
    /// The capture of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self::enough(|attempt| Self::drawn(seed, attempt))
    }

    /// The capture of a seed with points at random places of each view instead of a lattice: on a plane, or
    /// in a volume about it.
    #[must_use]
    pub fn scattered(seed: u64) -> Self {
        Self::enough(|attempt| {
            let depth = [0.0, 0.3][(seed % 2) as usize];
            Self { scattered: Some(depth), ..Self::drawn(seed, attempt) }
        })
    }

    /// The capture of a seed with a chart that is waved by hand.
    #[must_use]
    pub fn held_by_hand(seed: u64) -> Self {
        Self::enough(|attempt| {
            let drawn = Self::drawn(seed, attempt);
            let mut random = Random::stream(seed ^ 0x4a9d, attempt);
            let distance = drawn.placements[0].translation.z;
            let views = 8 + random.below(7);
            Self {
                placements: waved(&mut random, views, distance),
                pitch: HandHeld::SIZE * drawn.pitch,
                held_by_hand: true,
                named: [true, true],
                ..drawn
            }
        })
    }

    /// The first that every camera sees enough of.
    fn enough(draw: impl Fn(u64) -> Self) -> Self {
        // The common field of view of cameras far apart may be empty: then others are drawn.
        for attempt in 0..50 {
            let capture = draw(attempt);
            let data = capture.dataset();
            let seen = |view: usize, camera: usize| {
                let here = data.correspondences.iter().filter(|c| c.view == view);
                here.filter(|c| c.pixels[camera].is_some()).count()
            };
            let enough = (0..capture.placements.len())
                .all(|view| (0..capture.cameras.len()).all(|camera| seen(view, camera) >= 16));
            if enough || attempt == 49 {
                return capture;
            }
        }
        draw(0)
    }

    fn drawn(seed: u64, attempt: u64) -> Self {
        let mut random = Random::stream(seed, attempt);
        let (unit, size) = [("mm", 1000.0), ("cm", 100.0), ("m", 1.0)][random.below(3)];
        let count = 2 + random.below(3);
        let distance = size * random.uniform(0.3, 3.0);
        let (cameras, spread) = if random.below(3) == 0 {
            named_rig(&mut random, count, distance)
        } else {
            free_rig(&mut random, count, distance)
        };
        let counts = [6 + random.below(12), 5 + random.below(9)];
        let pitch = distance * spread * random.uniform(0.6, 1.0) / counts[0].max(counts[1]) as f64;
        let views = 5 + random.below(8);
        let tilted = random.below(2) == 0;
        let noise = match random.below(4) {
            0 => Noise::Quantised,
            _ => Noise::Normal(0.03 * libm::pow(10.0, random.uniform(0.0, 1.0))),
        };
        let placements = placements(&mut random, views, distance, tilted);
        Self {
            cameras,
            placements,
            counts,
            pitch,
            scattered: None,
            held_by_hand: false,
            noise,
            unit,
            named: [random.below(10) < 7, random.below(4) > 0 || tilted],
            lost: if random.below(2) == 0 { 0.0 } else { random.uniform(0.0, 0.1) },
            seed: seed.wrapping_mul(50).wrapping_add(attempt),
        }
    }

    /// A chart point by its column and row, in the chart's frame, the origin in its middle.
    #[must_use]
    pub fn chart_point(&self, column: usize, row: usize) -> Point3 {
        let place =
            |index: usize, count: usize| (index as f64 - (count as f64 - 1.0) / 2.0) * self.pitch;
        Point3::new(place(column, self.counts[0]), place(row, self.counts[1]), 0.0)
    }

    /// A point of a view in the chart's frame.
    fn point(&self, view: usize, index: usize) -> Point3 {
        let Some(depth) = self.scattered else {
            return self.chart_point(index % self.counts[0], index / self.counts[0]);
        };
        let mut random = Random::stream(self.seed ^ 0x5ca7, (view * 10_000 + index) as u64);
        let half = self.counts.map(|count| (count as f64 - 1.0) / 2.0 * self.pitch);
        let mut any = |half: f64| random.uniform(-half, half);
        Point3::new(any(half[0]), any(half[1]), any(depth * half[0]))
    }

    /// What the cameras record.
    #[must_use]
    pub fn dataset(&self) -> Dataset {
        self.recorded(|_, _, camera| camera.clone(), |_, place| place)
    }

    /// What cameras record that are changed by view, of a chart that is changed by view, while the
    /// file says what it should be.
    pub fn recorded(
        &self,
        camera_in: impl Fn(usize, usize, &PosedCamera) -> PosedCamera,
        chart_in: impl Fn(usize, Point3) -> Point3,
    ) -> Dataset {
        let mut random = Random::stream(self.seed, 77);
        let mut rows = Vec::new();
        for (view, placement) in self.placements.iter().enumerate() {
            let cameras: Vec<PosedCamera> = self
                .cameras
                .iter()
                .enumerate()
                .map(|(index, camera)| camera_in(view, index, camera))
                .collect();
            for index in 0..self.counts[0] * self.counts[1] {
                let on_chart = self.point(view, index);
                let world = placement.transform(on_chart);
                let real = placement.transform(chart_in(view, on_chart));
                let pixels: Vec<Option<Pixel>> = cameras
                    .iter()
                    .map(|camera| {
                        let lost = random.uniform(0.0, 1.0) < self.lost;
                        let pixel =
                            camera.project_visible(real).map(|p| self.noise.apply(p, &mut random));
                        pixel.filter(|_| !lost)
                    })
                    .collect();
                if pixels.iter().any(Option::is_some) {
                    rows.push(Correspondence {
                        view,
                        id: Some(self.name(view, index)),
                        pixels,
                        world: Some(world),
                        board: self.held_by_hand.then_some([on_chart.x, on_chart.y]),
                    });
                }
            }
        }
        Dataset {
            unit: self.unit.into(),
            cameras: self.cameras.len(),
            views: (0..self.placements.len()).map(|view| format!("v{view:02}")).collect(),
            correspondences: rows,
        }
    }

    /// No two views share the name of a point that they do not share.
    fn name(&self, view: usize, index: usize) -> String {
        let first = if self.scattered.is_some() { view * 10_000 } else { 0 };
        (first + index).to_string()
    }

    /// Without the names and places that this capture's file does not have.
    #[must_use]
    pub fn as_filed(&self, mut data: Dataset) -> Dataset {
        if self.held_by_hand {
            data.correspondences.iter_mut().for_each(|row| row.world = None);
        }
        if !self.named[0] {
            for row in &mut data.correspondences {
                row.id = None;
            }
        }
        if !self.named[1] {
            data.views.clear();
            for row in &mut data.correspondences {
                row.view = 0;
            }
        }
        data
    }
}

/// The rigs taken: a list of its own, so that a seed keeps its capture when there are more rigs.
const NAMED: [&str; 6] = ["paper", "pinhole", "fisheye", "water", "glass", "bump"];

/// The toolkit's own rigs, another size; and how wide their common view is over the distance.
fn named_rig(random: &mut Random, count: usize, distance: f64) -> (Vec<PosedCamera>, f64) {
    let name = NAMED[random.below(NAMED.len())];
    let Ok(rig) = Rig::named(name, count) else { return free_rig(random, count, distance) };
    // The rigs look at what is 95 away.
    let scale = distance / 95.0;
    let mut cameras = rig.cameras;
    for camera in &mut cameras {
        camera.camera_from_world.translation *= scale;
        if let AnyCamera::FlatPort(port) = &mut camera.model {
            port.distance *= scale;
            port.thickness *= scale;
        }
    }
    let spread = match name {
        "fisheye" => 1.6,
        "water" => 0.48,
        _ => 0.65,
    };
    (cameras, spread)
}

/// Cameras anywhere, aimed at the middle of the range.
fn free_rig(random: &mut Random, count: usize, distance: f64) -> (Vec<PosedCamera>, f64) {
    const SIZES: [[usize; 2]; 5] =
        [[640, 480], [1280, 720], [1920, 1080], [1024, 1024], [2448, 2048]];
    let [width, height] = SIZES[random.below(SIZES.len())];
    let focal = width as f64 * random.uniform(0.7, 1.8);
    let kind = random.below(3);
    let baseline = distance * random.uniform(0.06, 0.6);
    let start = random.uniform(0.0, std::f64::consts::TAU);
    let cameras = (0..count)
        .map(|index| {
            let angle = start
                + index as f64 * std::f64::consts::TAU / count as f64
                + random.uniform(-0.3, 0.3);
            let centre = Vector3::new(
                baseline / 2.0 * libm::cos(angle),
                baseline / 2.0 * libm::sin(angle),
                baseline * random.uniform(-0.1, 0.1),
            );
            let camera_from_world = aimed(random, centre, distance);
            let pinhole = Pinhole {
                focal: [focal * random.uniform(0.98, 1.02), focal * random.uniform(0.98, 1.02)],
                principal: [
                    width as f64 / 2.0 + random.uniform(-0.02, 0.02) * width as f64,
                    height as f64 / 2.0 + random.uniform(-0.02, 0.02) * height as f64,
                ],
            };
            PosedCamera { camera_from_world, model: lens(random, kind, pinhole), width, height }
        })
        .collect();
    let widest = if kind == 2 { 1.4 } else { 0.85 };
    (cameras, widest * width as f64 / focal * 0.8)
}

fn aimed(random: &mut Random, centre: Vector3, distance: f64) -> Pose {
    let aim = Vector3::new(
        distance * random.uniform(-0.03, 0.03),
        distance * random.uniform(-0.03, 0.03),
        distance,
    );
    let forward = (aim - centre).normalize();
    let right = Vector3::y().cross(&forward).normalize();
    let down = forward.cross(&right);
    let roll = Vector3::new(0.0, 0.0, random.uniform(-0.15, 0.15));
    let rotation = Pose::from_rotation_vector(Vector3::zeros(), roll).rotation
        * Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
    Pose { rotation, translation: -(rotation * centre) }
}

fn lens(random: &mut Random, kind: usize, pinhole: Pinhole) -> AnyCamera {
    match kind {
        0 => pinhole.into(),
        1 => BrownConrady {
            radial: [random.uniform(-0.3, 0.1), random.uniform(0.0, 0.1), 0.0],
            tangential: [random.uniform(-0.001, 0.001), random.uniform(-0.001, 0.001)],
            ..BrownConrady::ideal(pinhole)
        }
        .into(),
        _ => KannalaBrandt {
            pinhole: Pinhole { focal: pinhole.focal.map(|f| f * 0.6), ..pinhole },
            coefficients: [random.uniform(-0.03, 0.03), random.uniform(-0.005, 0.005), 0.0, 0.0],
        }
        .into(),
    }
}

fn placements(random: &mut Random, count: usize, distance: f64, tilted: bool) -> Vec<Pose> {
    let (near, far) = (distance * random.uniform(0.7, 0.8), distance * random.uniform(1.2, 1.5));
    let even = random.below(2) == 0;
    let mut depths: Vec<f64> = (0..count)
        .map(|view| {
            let jitter = if even { 0.0 } else { random.uniform(-0.3, 0.3) };
            near + (far - near) * (view as f64 + jitter) / (count as f64 - 1.0)
        })
        .collect();
    if tilted && random.below(2) == 0 {
        random.shuffle(&mut depths);
    }
    let wide = if tilted { 0.35 } else { 0.0 };
    let aside = if tilted { 0.08 * distance } else { 0.0 };
    depths
        .into_iter()
        .map(|depth| {
            let rotation = Vector3::new(
                random.uniform(-wide, wide),
                random.uniform(-wide, wide),
                random.uniform(-wide, wide) / 2.0,
            );
            let place =
                Vector3::new(random.uniform(-aside, aside), random.uniform(-aside, aside), depth);
            Pose::from_rotation_vector(place, rotation)
        })
        .collect()
}

/// Where a hand holds a chart, from a nearest distance on.
fn waved(random: &mut Random, count: usize, near: f64) -> Vec<Pose> {
    let HandHeld { tilt, .. } = HandHeld::default();
    let place = |_| {
        let mut up_to = |most: f64| random.uniform(-most, most);
        let turn = Vector3::new(up_to(tilt), up_to(tilt), up_to(0.6 * tilt));
        let aside = 0.06 * near;
        let centre = Vector3::new(up_to(aside), up_to(aside), near * (1.4 + up_to(0.4)));
        Pose::from_rotation_vector(centre, turn)
    };
    (0..count).map(place).collect()
}
