//! Tests of the learner against arms whose parameters are known.
