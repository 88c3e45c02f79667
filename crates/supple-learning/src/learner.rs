//! The learner, which converts records of control cycles to requests with learned parameters.

use crate::freeze::FreezeReason;
use crate::gate::SlidingGate;
use crate::information::Information;
use crate::prior::Prior;
use crate::prior::unknowns::VISCOUS;
use crate::report::Report;
use crate::rows::{Row, Rows};
use crate::solve::{Estimate, of_prior, solve};
use std::collections::VecDeque;
use supple_core::Config;
use supple_core::controller::{CycleRecord, Request};
use supple_core::learned::LearnedTerms;
use supple_core::math::exp;

/// Time over which equations are averaged to a sample \[s\]. The velocity is a difference quotient: its noise is large in single
/// cycles and small in the mean.
const SAMPLE_S: f64 = 0.05;
/// Time over which errors of the model are correlated: one sample of this time is independent \[s\].
const CORRELATION_S: f64 = 0.2;
/// Length of the intervals in which samples are collected, checked and used \[s\].
const INTERVAL_S: f64 = 0.25;
/// Number of intervals for which samples wait before they are used; a freeze during this time discards them.
const WAITING: usize = 2;
/// Time after a freeze in which no samples are collected \[s\].
const AFTER_FREEZE_S: f64 = 0.5;
/// Time constant of forgetting, in time of motion \[s\]. With a longer memory, errors that no unknown explains would have more
/// weight than the prior.
const FORGET_S: f64 = 30.0;
/// An interval is disturbed if its error is greater than this multiple of its standard deviation.
const DISTURBED: f64 = 4.0;
/// Time of unexplained torque in free motion after which the learner assumes that the arm has changed \[s\].
const PERSISTENT_S: f64 = 20.0;
/// Factor of the weight of older samples after such a change.
const KEPT_AFTER_CHANGE: f64 = 0.02;
/// Time of samples that a joint must have in each direction before they are used, or in one if it creeps \[s\]. In one direction, dry
/// friction is not told apart from an offset or a payload, and the errors of a short motion have one sign. But a joint that creeps may
/// never reverse: what is left of its friction drives it on in one direction, and that sum is what its samples determine.
const MIN_DIRECTION_S: f64 = 0.25;
/// Time between estimates \[s\].
const SOLVE_S: f64 = 1.0;
/// Time from the last sample of an estimate until the controller applies the estimate, and its minimum in cycles. Queues between
/// controller and learner are shorter, so that the cycle of application does not depend on the speed of either.
const LATENCY_S: f64 = 2.0;
const MIN_LATENCY_CYCLES: u64 = 2500;
/// Time constant of the measured residual, in intervals.
const RESIDUAL_INTERVALS: f64 = 40.0;

/// A request with the cycle in which the controller must execute it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheduled<const N: usize> {
    /// Cycle.
    pub at_cycle: u64,
    /// Learned parameters, or the map of a joint.
    pub request: Request<N>,
}

/// Returns the number of cycles from the last sample of an estimate until the controller applies the estimate.
fn latency_cycles(period_s: f64) -> u64 {
    ((LATENCY_S / period_s) as u64).max(MIN_LATENCY_CYCLES)
}

/// Returns how many requests of a learner wait for their cycle at most, but for those that follow a reset: one for each joint and one
/// more for each estimate.
pub fn requests_in_flight(joints: usize, period_s: f64) -> usize {
    let estimates = (latency_cycles(period_s) as f64 * period_s / SOLVE_S).ceil() as usize + 1;
    estimates * (joints + 1)
}

/// Learns from the records of a controller.
#[derive(Clone, Debug)]
pub struct Learner<const N: usize> {
    prior: Prior<N>,
    period_s: f64,
    rows: Rows<N>,
    last_cycle: Option<u64>,
    /// Time since the last freeze \[s\].
    since_freeze_s: f64,
    gates: [SlidingGate; N],
    /// Sum of each joint's equations since the last sample, and their number; `None` if one of these equations must not be used.
    sums: Vec<Option<Row>>,
    summed: u32,
    cycles_per_sample: u32,
    interval_s: f64,
    /// Samples since a joint was last known to have moved: they are discarded if it rests.
    unconfirmed: Vec<Information>,
    collecting: Vec<Information>,
    waiting: VecDeque<Vec<Information>>,
    samples: Vec<Information>,
    /// Whether the samples of each joint have been enough; those of other joints are not used yet.
    counts: [bool; N],
    /// Joints whose map a request has changed.
    requested: [bool; N],
    estimate: Option<Estimate>,
    since_solve_s: f64,
    has_new_samples: bool,
    /// Measured variance of the residual torque of the estimate \[N^2 m^2\].
    residual: [f64; N],
    disturbed_s: f64,
    disturbances: u64,
    frozen: Option<FreezeReason>,
}

impl<const N: usize> Learner<N> {
    /// Creates the learner of a controller with this configuration, before its first cycle.
    pub fn new(config: &Config<N>) -> Learner<N> {
        let prior = Prior::new(config);
        Learner {
            rows: Rows::new(config),
            estimate: of_prior(&prior),
            period_s: config.period_s,
            last_cycle: None,
            since_freeze_s: 0.0,
            gates: config.friction.map(|friction| SlidingGate::new(&friction)),
            sums: vec![Some(Row::ZERO); N],
            summed: 0,
            cycles_per_sample: ((SAMPLE_S / config.period_s) as u32).max(1),
            interval_s: 0.0,
            unconfirmed: vec![Information::empty(); N],
            collecting: vec![Information::empty(); N],
            waiting: VecDeque::new(),
            samples: vec![Information::empty(); N],
            counts: [false; N],
            requested: [false; N],
            since_solve_s: 0.0,
            has_new_samples: false,
            residual: [0.0; N],
            disturbed_s: 0.0,
            disturbances: 0,
            frozen: Some(FreezeReason::Off),
            prior,
        }
    }

    /// Forgets all samples and resets the estimate to the prior.
    pub fn reset(&mut self) {
        self.samples = vec![Information::empty(); N];
        self.counts = [false; N];
        self.estimate = of_prior(&self.prior);
        self.residual = [0.0; N];
        self.disturbed_s = 0.0;
        self.has_new_samples = false;
        self.discard();
    }

    /// Returns the present estimates.
    pub fn report(&self) -> Report<N> {
        let zero = LearnedTerms::zero();
        let of = |part: fn(&Estimate) -> LearnedTerms<N>| self.estimate.as_ref().map_or(zero, part);
        Report {
            terms: of(Estimate::terms),
            deviations: of(Estimate::deviations),
            learned_s: core::array::from_fn(|i| match self.counts[i] {
                true => self.seconds(i, self.samples[i].weight),
                false => 0.0,
            }),
            residual_nm: self.residual.map(f64::sqrt),
            disturbances: self.disturbances,
            frozen: self.frozen,
        }
    }

    /// Returns the time of samples of a joint that have this weight \[s\].
    fn seconds(&self, joint: usize, weight: f64) -> f64 {
        weight * self.prior.noise_nm[joint].powi(2) * CORRELATION_S
    }

    /// Processes the record of a cycle; returns the requests of a new estimate, in most cycles none.
    pub fn observe(&mut self, record: &CycleRecord<N>) -> Vec<Scheduled<N>> {
        use supple_core::codes::request_kind;
        let cycle = record.input_cycle;
        let mut requests = Vec::new();
        if record.request == request_kind::LEARNING
            && record.refusal == 0
            && record.request_values.values() == [2.0]
        {
            self.reset();
            // Estimates from before are still on their way to the controller; the prior follows them.
            requests = self.requests(cycle);
        }
        let follows = self.last_cycle.is_some_and(|last| cycle == last + 1);
        self.last_cycle = Some(cycle);
        if !follows {
            self.rows.restart();
            self.freeze();
        }
        let rows = self.rows.add_cycle(record);
        self.since_freeze_s += self.period_s;
        for (i, gate) in self.gates.iter_mut().enumerate() {
            let (angle_rad, direction) = (record.position_rad[i], self.rows.direction()[i]);
            gate.update(
                angle_rad,
                rows[i].columns[VISCOUS],
                direction,
                self.period_s,
            );
        }
        match FreezeReason::of_cycle(record) {
            Some(frozen) => {
                self.frozen = Some(frozen);
                self.freeze();
                return requests;
            }
            None if self.since_freeze_s < AFTER_FREEZE_S => return requests,
            None => {}
        }
        self.collect(&rows);
        self.interval_s += self.period_s;
        if self.interval_s >= INTERVAL_S {
            self.interval_s = 0.0;
            self.end_interval();
        }
        self.since_solve_s += self.period_s;
        if self.since_solve_s >= SOLVE_S && self.has_new_samples {
            self.since_solve_s = 0.0;
            self.has_new_samples = false;
            requests.extend(self.requests(cycle));
        }
        requests
    }

    /// Adds a cycle to the samples of the joints that move. A sample is the mean equation of the cycles since the last sample.
    fn collect(&mut self, rows: &[Row]) {
        for (i, (sum, row)) in self.sums.iter_mut().zip(rows).enumerate() {
            if !self.gates[i].is_open() {
                *sum = None;
                self.unconfirmed[i] = Information::empty();
            } else if let Some(sum) = sum {
                sum.add(row);
            }
        }
        self.summed += 1;
        if self.summed >= self.cycles_per_sample {
            self.end_sample();
        }
        for (i, gate) in self.gates.iter().enumerate() {
            if gate.has_moved() && !self.unconfirmed[i].is_empty() {
                let confirmed = core::mem::replace(&mut self.unconfirmed[i], Information::empty());
                self.collecting[i].merge(&confirmed);
            }
        }
    }

    fn end_sample(&mut self) {
        let cycles = f64::from(self.summed);
        for (i, sum) in self.sums.iter_mut().enumerate() {
            if let Some(sum) = sum {
                let weight =
                    cycles * self.period_s / CORRELATION_S / self.prior.noise_nm[i].powi(2);
                let creeps = self.gates[i].creeps_on();
                self.unconfirmed[i].add(&sum.scaled(1.0 / cycles), weight, creeps);
            }
        }
        self.begin_sample();
    }

    fn begin_sample(&mut self) {
        self.sums = vec![Some(Row::ZERO); N];
        self.summed = 0;
    }

    /// Discards all samples that have not been used.
    fn discard(&mut self) {
        self.waiting.clear();
        self.unconfirmed = vec![Information::empty(); N];
        self.collecting = vec![Information::empty(); N];
        self.begin_sample();
        self.interval_s = 0.0;
    }

    fn freeze(&mut self) {
        if self.since_freeze_s > 0.0 {
            self.discard();
        }
        self.since_freeze_s = 0.0;
    }

    /// Checks the samples of an interval for disturbances, and uses the samples that have waited.
    fn end_interval(&mut self) {
        let interval = core::mem::replace(&mut self.collecting, vec![Information::empty(); N]);
        if interval.iter().all(Information::is_empty) {
            self.frozen = Some(FreezeReason::Slow);
            return;
        }
        if self.is_disturbed(&interval) {
            self.disturbances += 1;
            self.disturbed_s += INTERVAL_S + AFTER_FREEZE_S;
            self.frozen = Some(FreezeReason::Disturbed);
            self.freeze();
            if self.disturbed_s >= PERSISTENT_S {
                self.accept_change(&interval);
            }
            return;
        }
        self.frozen = None;
        // In some intervals a lasting change causes almost no error, so an undisturbed interval does not reset the time.
        self.disturbed_s = (self.disturbed_s - INTERVAL_S).max(0.0);
        self.waiting.push_back(interval);
        if self.waiting.len() > WAITING
            && let Some(oldest) = self.waiting.pop_front()
        {
            self.take(&oldest);
        }
    }

    fn is_disturbed(&self, interval: &[Information]) -> bool {
        let Some(estimate) = &self.estimate else {
            return false;
        };
        interval.iter().enumerate().any(|(i, samples)| {
            let noise = self.prior.noise_nm[i].powi(2).max(self.residual[i]);
            !samples.is_empty() && {
                let expected = noise + samples.mean_variance(&estimate.covariance[i]);
                samples.mean_square(&estimate.unknowns(i)) > DISTURBED * DISTURBED * expected
            }
        })
    }

    /// Adapts to a change of the arm: reduces the weight of older samples, and raises the expected residual so that an error as
    /// large as in this interval is no disturbance until the residual has decreased.
    fn accept_change(&mut self, interval: &[Information]) {
        self.disturbed_s = 0.0;
        if let Some(estimate) = &self.estimate {
            for (i, samples) in interval.iter().enumerate() {
                if !samples.is_empty() {
                    let square = samples.mean_square(&estimate.unknowns(i));
                    self.residual[i] = self.residual[i].max(square);
                }
            }
        }
        for samples in &mut self.samples {
            samples.forget(KEPT_AFTER_CHANGE);
        }
        self.estimate = self.solve().or_else(|| of_prior(&self.prior));
    }

    fn take(&mut self, interval: &[Information]) {
        for (i, new) in interval.iter().enumerate() {
            if new.is_empty() {
                continue;
            }
            let learned_s = self.seconds(i, new.weight);
            self.samples[i].forget(exp(-learned_s / FORGET_S));
            self.samples[i].merge(new);
            let rarer_s = self.seconds(i, self.samples[i].weight_in_rarer_direction());
            let creeping_s = self.seconds(i, self.samples[i].creeping_weight);
            self.counts[i] |= rarer_s >= MIN_DIRECTION_S || creeping_s >= MIN_DIRECTION_S;
            if let Some(estimate) = &self.estimate {
                let square = new.mean_square(&estimate.unknowns(i));
                let known = new.mean_variance(&estimate.covariance[i]);
                self.residual[i] +=
                    ((square - known).max(0.0) - self.residual[i]) / RESIDUAL_INTERVALS;
            }
        }
        self.has_new_samples = true;
    }

    /// Returns the estimate from the joints that count.
    fn solve(&self) -> Option<Estimate> {
        let used = |(samples, counts): (&Information, bool)| match counts {
            true => samples.clone(),
            false => Information::empty(),
        };
        let used: Vec<_> = self.samples.iter().zip(self.counts).map(used).collect();
        solve(&self.prior, &used)
    }

    /// Returns a new estimate as requests, all for a cycle later than the learner's maximum delay; none before a joint counts.
    fn requests(&mut self, cycle: u64) -> Vec<Scheduled<N>> {
        let Some(estimate) = self.solve() else {
            return Vec::new();
        };
        let terms = estimate.terms::<N>();
        self.estimate = Some(estimate);
        for (requested, counts) in self.requested.iter_mut().zip(self.counts) {
            *requested |= counts;
        }
        if !self.requested.contains(&true) {
            return Vec::new();
        }
        let at_cycle = cycle + latency_cycles(self.period_s);
        let parameters = Request::LearnedParameters(terms.parameters);
        let maps = (0..N).filter(|i| self.requested[*i]);
        let maps = maps.map(|joint| Request::LearnedMap {
            joint,
            map: terms.map[joint],
        });
        core::iter::once(parameters)
            .chain(maps)
            .map(|request| Scheduled { at_cycle, request })
            .collect()
    }
}
