// The version of the library, by the rules of semver.org.
#pragma once

#define CARPOOL_VERSION_MAJOR 0
#define CARPOOL_VERSION_MINOR 1
#define CARPOOL_VERSION_PATCH 0
#define CARPOOL_VERSION "0.1.0"
