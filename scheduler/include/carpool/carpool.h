// Everything in one include: the graph, its run, and the report.
#pragma once

#include "carpool/batch.h"
#include "carpool/cancel.h"
#include "carpool/emitter.h"
#include "carpool/errors.h"
#include "carpool/graph.h"
#include "carpool/monitor.h"
#include "carpool/policy.h"
#include "carpool/report.h"
#include "carpool/run.h"
#include "carpool/trace.h"
#include "carpool/version.h"
