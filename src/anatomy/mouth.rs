//! What is made of the lips once they part: the nodes that drive their rims, and what lies behind them.

use std::{collections::BTreeSet, sync::Arc};

use nalgebra::{Point3, Vector3};

use super::{
    FaceFrame, atlas,
    interior::Interior,
    join::encoded,
    lip_line::LipLine,
    lips::Lips,
    model::{Mouth, PartKind, RimNode, RimVertex},
    part::PartMesh,
    prepare::Preparation,
    regions::{INNER_CORNERS, LOWER_INNER, UPPER_INNER},
};
use crate::scan::Material;

/// Gloss of teeth and tongue, and of the cavity.
const WET_MOUTH: f32 = 0.35;
const DULL_CAVITY: f32 = 0.05;
/// What lies behind skin stays at least this far behind it, mouth widths.
const TUCKED: f64 = 0.03;
/// Nodes of the lips' rims nearer to each other than this are one, millimetres.
const CLOSEST_NODES: f64 = 0.15;
/// Where a scan's own cavity is looked for: around the mouth's middle and behind the lips, mouth widths.
const BAG_REACH: f64 = 0.9;
const BAG_START: f64 = 0.08;
const BAG_DEPTH: f64 = 2.6;
/// The cavity of an open mouth starts this far behind its lips, mouth widths.
const BEHIND_OPEN: f64 = 0.05;
/// Fewer hidden triangles than this are a fold.
const FEWEST_BAG: usize = 60;
/// Behind lips that have teeth of their own lie more vertices of other pieces than this.
const FEWEST_TEETH: usize = 60;
/// Teeth are left out where more than this share of them would stick in the scan's own cavity's walls.
const MOST_HIDDEN: f64 = 0.2;
/// A cavity has at most this many edges with nothing beyond.
const MOST_ENDS: usize = 6;

impl Preparation<'_> {
    /// Makes the mouth of lips that part.
    pub(super) fn mouth(&mut self, line: &LipLine, lips: &Lips, lower_side: &[f32]) -> Mouth {
        let up = line.up();
        let up = self.frame.leave_vector(&Vector3::new(up.x, up.y, 0.0));
        let rims = match lips {
            Lips::Cut(slit) => [slit.upper.clone(), slit.lower.clone()],
            Lips::Open => self.open_rims(line, lower_side),
        };
        let [upper, lower] =
            [&rims[0], &rims[1]].map(|rim| rim.iter().map(|&place| *self.edit.at(place)).collect::<Vec<_>>());
        let interior = match lips {
            Lips::Cut(_) => Interior::new(line, &upper, &lower, self.frame.mouth),
            Lips::Open => {
                let [above, below] = [&upper, &lower].map(|rim| self.behind(line, rim));
                Interior::new(line, &above, &below, self.frame.mouth)
            }
        };
        let picture = Arc::new(encoded("mouth", &atlas::paint()));
        let material = |kind: PartKind| Material {
            name: kind.name().to_owned(),
            base_colour: [1.0; 4],
            texture: Some(Arc::clone(&picture)),
            gloss: if kind == PartKind::Cavity { DULL_CAVITY } else { WET_MOUTH },
        };
        let bag = if matches!(lips, Lips::Open) { self.own_bag(line, &upper) } else { Vec::new() };
        let (mut ring, mut hanging) = (Vec::new(), Vec::new());
        if bag.is_empty() {
            (ring, hanging) = (interior.ring, interior.hanging);
            for point in &mut ring {
                point.place = self.frame.leave(&point.place);
            }
            let cavity = self.tucked(interior.cavity);
            self.parts.push((PartKind::Cavity, cavity, material(PartKind::Cavity)));
        }
        let no_room = matches!(lips, Lips::Open)
            && (self.has_own_teeth(line, &upper) || self.is_narrow(&bag, &interior.upper_teeth));
        for (kind, part) in [
            (PartKind::UpperTeeth, interior.upper_teeth),
            (PartKind::LowerTeeth, interior.lower_teeth),
            (PartKind::Tongue, interior.tongue),
        ] {
            if !no_room {
                let part = self.tucked(part);
                self.parts.push((kind, part, material(kind)));
            }
        }
        self.bag = bag;
        self.flesh = Some(material(PartKind::Cavity));
        let on_rim = |along: f64| self.frame.leave(&rim_place(line, &upper, along));
        let (nodes, corners) = match lips {
            Lips::Cut(_) => (self.cut_nodes(line, &upper), line.corners.map(|along| Some(on_rim(along)))),
            Lips::Open => (open_nodes(&self.frame, &upper, &lower), [None, None]),
        };
        let held = if matches!(lips, Lips::Cut(_)) { self.held(line, &rims, &nodes) } else { Vec::new() };
        Mouth { is_cut: matches!(lips, Lips::Cut(_)), rims, nodes, held, corners, up, ring, hanging }
    }

    /// The rims of an open mouth at the network's stations: on each lip the vertex nearest to where the landmark should
    /// be, since the network takes one lip's rim for the other's where they touch.
    fn open_rims(&self, line: &LipLine, lower_side: &[f32]) -> [Vec<u32>; 2] {
        let stations = self.stations(line);
        let positions = &self.edit.mesh().positions;
        let nearest = |target: Point3<f64>, allowed: &dyn Fn(usize) -> bool| -> u32 {
            let far = |v: usize| (positions[v] - target).norm_squared();
            let best =
                (0..positions.len()).filter(|&v| allowed(v)).min_by(|&a, &b| far(a).total_cmp(&far(b)));
            best.map_or(0, |v| self.edit.place(v as u32))
        };
        let place = |k: usize| {
            let on_line = line.place(stations[k]);
            let z = match k {
                0 => self.landmarks[INNER_CORNERS[0]].map(|p| p.z),
                k if k < stations.len() - 1 => {
                    let (u, l) = (self.landmarks[UPPER_INNER[k - 1]], self.landmarks[LOWER_INNER[k - 1]]);
                    u.iter().chain(&l).map(|p| p.z).reduce(f64::max)
                }
                _ => self.landmarks[INNER_CORNERS[1]].map(|p| p.z),
            };
            Point3::new(on_line.x, on_line.y, z.unwrap_or(0.0))
        };
        let last = stations.len() - 1;
        let ends = [0, last].map(|k| nearest(place(k), &|_| true));
        let rim = |lower: bool| -> Vec<u32> {
            let of_lip = |v: usize| (lower_side[v] > 0.5) == lower;
            let own = |k: usize| {
                let landmark = if lower { LOWER_INNER[k - 1] } else { UPPER_INNER[k - 1] };
                let mut target = place(k);
                if let Some(p) = self.landmarks[landmark] {
                    target.y = p.y;
                }
                nearest(target, &of_lip)
            };
            std::iter::once(ends[0]).chain((1..last).map(own)).chain([ends[1]]).collect()
        };
        [rim(false), rim(true)]
    }

    /// A part of the mouth, drawn back where it would stand out of a thin lip or chin.
    fn tucked(&self, mut part: PartMesh) -> PartMesh {
        for p in &mut part.positions {
            if let Some(skin) = self.depth(p.x, p.y) {
                p.z = p.z.min((skin - TUCKED * self.frame.mouth).max(p.z - 0.3 * self.frame.mouth));
            }
        }
        part
    }

    /// A smooth curve along the line, as deep as a rim, a little behind the lips.
    fn behind(&self, line: &LipLine, rim: &[Point3<f64>]) -> Vec<Point3<f64>> {
        const COLUMNS: usize = 25;
        (0..COLUMNS)
            .map(|i| {
                let t = i as f64 / (COLUMNS - 1) as f64;
                let along = line.corners[0] + (line.corners[1] - line.corners[0]) * t;
                let place = line.place(along);
                Point3::new(place.x, place.y, rim_place(line, rim, along).z - BEHIND_OPEN * self.frame.mouth)
            })
            .collect()
    }

    /// Whether the scan's own cavity leaves no room for teeth: its walls stand before many of them.
    fn is_narrow(&self, bag: &[u32], teeth: &PartMesh) -> bool {
        let bag: BTreeSet<u32> = bag.iter().copied().collect();
        let forward = self.frame.leave_vector(&Vector3::z());
        let hidden = teeth.positions.iter().filter(|p| {
            let hit = self.surface.cast(self.frame.leave(p), forward);
            hit.is_some_and(|hit| bag.contains(&hit.triangle))
        });
        hidden.count() as f64 > MOST_HIDDEN * teeth.positions.len() as f64
    }

    /// Whether pieces of their own lie behind the lips: teeth that somebody has modelled.
    fn has_own_teeth(&self, line: &LipLine, rim: &[Point3<f64>]) -> bool {
        let mouth = self.frame.mouth;
        let component = self.edit.components();
        let skin = rim.first().and_then(|p| {
            let far = |v: &usize| (self.edit.at(*v as u32) - p).norm_squared();
            (0..component.len()).min_by(|a, b| far(a).total_cmp(&far(b))).map(|v| component[v])
        });
        let front = rim.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        let behind = |p: &Point3<f64>| {
            let (along, depth) = (line.along(p), front - p.z);
            (line.ends[0]..line.ends[1]).contains(&along)
                && line.above(p).abs() < 0.35 * mouth
                && (BAG_START * mouth..mouth).contains(&depth)
        };
        let pieces = self.edit.mesh().positions.iter().zip(&component);
        pieces.filter(|(p, name)| Some(**name) != skin && behind(p)).count() > FEWEST_TEETH
    }

    /// Triangles of the scan's own cavity, if it has one: behind the lips and hidden by them.
    fn own_bag(&self, line: &LipLine, rim: &[Point3<f64>]) -> Vec<u32> {
        let mouth = self.frame.mouth;
        let front = rim.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        let middle = line.place(0.0);
        let reach = BAG_REACH * mouth;
        let patch = self.edit.patch(
            &Point3::new(middle.x - reach, middle.y - reach, front - BAG_DEPTH * mouth),
            &Point3::new(middle.x + reach, middle.y + reach, front - BAG_START * mouth),
        );
        let hidden = |triangle: &u32| {
            let corners = self.edit.mesh().triangles[*triangle as usize];
            let middle = corners.map(|v| self.edit.at(v).coords).iter().sum::<Vector3<f64>>() / 3.0;
            let is_behind = middle.z < front - BAG_START * mouth;
            is_behind && self.depth(middle.x, middle.y).is_some_and(|z| z - middle.z > BAG_START * mouth)
        };
        let bag: Vec<u32> = patch.iter().copied().filter(hidden).collect();
        // Nostrils are hidden too, but hang together with nothing behind the lips.
        let near_lips = |piece: &Vec<u32>| {
            let behind = |t: &u32| {
                let corners = self.edit.corners(*t).map(|c| self.edit.at(c));
                let off = |p: &Point3<f64>| line.above(p).abs().max(line.along(p).abs() - line.corners[1]);
                corners.iter().any(|p| off(p) < BAG_START * mouth && p.z > front - 0.5 * mouth)
            };
            piece.iter().any(behind)
        };
        tracing::info!(
            "{} of {} triangles behind the lips are hidden",
            bag.len(),
            self.edit.mesh().triangles.len()
        );
        let pieces = self.edit.pieces(&bag).into_iter().filter(near_lips);
        let largest = pieces.max_by_key(Vec::len).unwrap_or_default();
        // A few hidden triangles are a fold, not a mouth; one that ends in an edge is the lips' lining.
        let around = self.edit.edges(&patch);
        let ends = self.edit.edges(&largest).keys().filter(|edge| around[edge].len() == 1).count();
        if largest.len() < FEWEST_BAG || ends > MOST_ENDS { Vec::new() } else { largest }
    }

    /// Along-coordinates of the network's stations, ascending.
    fn stations(&self, line: &LipLine) -> Vec<f64> {
        let pairs = UPPER_INNER.iter().zip(&LOWER_INNER);
        let mut stations = vec![line.corners[0]];
        for (&u, &l) in pairs {
            let both: Vec<f64> =
                [u, l].iter().filter_map(|&i| Some(line.along(&self.landmarks[i]?))).collect();
            let last = stations[stations.len() - 1];
            let mean = both.iter().sum::<f64>() / both.len().max(1) as f64;
            stations.push(if both.is_empty() { last } else { mean.max(last) });
        }
        stations.push(line.corners[1].max(stations[stations.len() - 1]));
        stations
    }

    /// Two nodes to a stretch between stations, four to those at the corners; and beyond the inner corners two that keep
    /// the rims together to the ends of the cut.
    fn cut_nodes(&self, line: &LipLine, rim: &[Point3<f64>]) -> Vec<RimNode> {
        let stations = self.stations(line);
        let last = stations.len() - 1;
        let between = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let beyond =
            |station: usize, end: f64| [0.0, 0.5].map(|t| (station, 0.0, between(end, stations[station], t)));
        let mut wanted = beyond(0, line.ends[0]).to_vec();
        for station in 0..last {
            let is_end = station == 0 || station + 1 == last;
            let shares: &[f64] = if is_end { &[0.0, 0.25, 0.5, 0.75] } else { &[0.0, 0.5] };
            let stretch = shares
                .iter()
                .map(|&share| (station, share, between(stations[station], stations[station + 1], share)));
            // The corner itself is a landmark's control.
            wanted.extend(stretch.skip(usize::from(station == 0)));
        }
        wanted.extend(beyond(last, line.ends[1]).into_iter().rev());
        let mut nodes: Vec<RimNode> = Vec::new();
        for (station, share, along) in wanted {
            let rest = self.frame.leave(&rim_place(line, rim, along));
            if nodes.last().is_none_or(|last| (last.rest[0] - rest).norm() >= CLOSEST_NODES) {
                nodes.push(RimNode { station, share, rest: [rest; 2] });
            }
        }
        nodes
    }

    /// Between which nodes every vertex of the rims lies.
    fn held(&self, line: &LipLine, rims: &[Vec<u32>; 2], nodes: &[RimNode]) -> Vec<RimVertex> {
        let places: Vec<f64> =
            nodes.iter().map(|node| line.along(&self.frame.enter(&node.rest[0]))).collect();
        let lips: [BTreeSet<u32>; 2] = [0, 1].map(|lip| rims[lip].iter().copied().collect());
        let vertices = 0..self.edit.mesh().positions.len() as u32;
        let held = vertices.filter_map(|vertex| {
            let place = self.edit.place(vertex);
            let lower = !lips[0].contains(&place);
            if lower && !lips[1].contains(&place) {
                return None;
            }
            let along = line.along(self.edit.at(vertex));
            let right = places.partition_point(|p| *p < along).clamp(1, places.len() - 1);
            let (a, b) = (places[right - 1], places[right]);
            let share = if b > a { ((along - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
            Some(RimVertex { vertex, lower, nodes: [right - 1, right], share })
        });
        if places.len() < 2 { Vec::new() } else { held.collect() }
    }
}

/// The network's pairs where the mouth was open: each on its own lip.
fn open_nodes(frame: &FaceFrame, upper: &[Point3<f64>], lower: &[Point3<f64>]) -> Vec<RimNode> {
    let pairs = upper.iter().zip(lower).enumerate().skip(1).take(UPPER_INNER.len());
    pairs
        .map(|(station, (u, l))| RimNode { station, share: 0.0, rest: [frame.leave(u), frame.leave(l)] })
        .collect()
}

/// The place on a rim at an along-coordinate.
fn rim_place(line: &LipLine, rim: &[Point3<f64>], along: f64) -> Point3<f64> {
    let at = |i: usize| line.along(&rim[i]);
    let crossing = (1..rim.len()).find(|&i| at(i) >= along);
    let right = crossing.unwrap_or(rim.len() - 1);
    let (a, b) = (at(right - 1), at(right));
    let t = if b > a { ((along - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
    rim[right - 1] + (rim[right] - rim[right - 1]) * t
}
