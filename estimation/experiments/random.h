// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random numbers of the experiments: those of lib/math.

#include "tangible/math/random.h"
