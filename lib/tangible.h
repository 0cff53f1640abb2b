// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The engine, for programs that use it: scenes and their numbers by path, runs, derivatives with
// their certificates, plans, pictures, and single LCPs without bodies. Names and meanings of what
// these headers declare stay; others are installed because these include them, and may change with
// any version. Fits are in tangible/estimation/fit/fit.h, of the library tangible::estimation.

#include "tangible/control/engine_step.h"
#include "tangible/control/ilqr.h"
#include "tangible/control/model_predictive.h"
#include "tangible/dynamics/model/model.h"
#include "tangible/lcp/dense/derivative.h"
#include "tangible/lcp/dense/solver.h"
#include "tangible/render/plot.h"
#include "tangible/render/view.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/gradient/batch.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/gradient/rollout_function.h"
#include "tangible/simulation/stepping/rollout.h"
