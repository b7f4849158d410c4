// SPDX-License-Identifier: MIT
#pragma once

/// Many jobs in one folder, by any number of processes on any number of machines: what each asks is
/// hashed, what came of it is a line of JSON, and a lock keeps two from doing the same work. Knows
/// nothing of what a job does.
///
/// From the inside out:
///   job_list.h     a list of jobs, one a line
///   job_hash.h     what a job asks: options, version, contents of its inputs
///   job_owner.h    locks by hard links, with a heartbeat; those of killed owners are taken over
///   job_journal.h  what came of the jobs, in lines that are only ever added to
///   run_jobs.h     RunJobs: all of it
#include "geometry/jobs/job_hash.h"
#include "geometry/jobs/job_journal.h"
#include "geometry/jobs/job_list.h"
#include "geometry/jobs/job_owner.h"
#include "geometry/jobs/run_jobs.h"
