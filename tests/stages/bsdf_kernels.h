// The BSDF and microfacet kernels as plain functions over columns of numbers, for every target and
// width.
#pragma once

#include <string>

#include "tests/stages/sampling_kernels.h"

namespace carpool::tests {

/// One material for all lanes.
struct Surface {
  std::string name;
  double base[3] = {1, 1, 1};
  double metallic = 0, roughness = 0.5, ior = 1.5;
  bool ior_zero = false;
  double specular = 1;
  double specular_color[3] = {1, 1, 1};
};

struct Direction {
  double x, y, z;
};

/// Columns of each kernel's result.
enum SampleColumn {
  kSampleX,
  kSampleY,
  kSampleZ,
  kWeightR,
  kWeightG,
  kWeightB,
  kSamplePdf,
  kValid,
  kSampleColumns
};
enum ValueColumn { kValueR, kValueG, kValueB, kValuePdf, kValueColumns };
enum VisibleColumn { kVisibleX, kVisibleY, kVisibleZ, kVisibleWeight, kVisibleColumns };
enum FresnelColumn { kDielectric, kConductor, kSchlick, kSchlickMean, kFresnelColumns };

struct BsdfKernels {
  std::string name;
  bool is_double;
  /// u: lobe, x, y -> SampleColumn.
  Columns (*sample)(const Surface&, const Direction& wo, const Columns& u);
  /// wo xyz, wi xyz -> ValueColumn.
  Columns (*evaluate)(const Surface&, const Columns& directions);
  /// u: x, y -> VisibleColumn: the mirror direction about a visible normal, also below the surface,
  /// and G2 / G1.
  Columns (*visible)(double alpha, const Direction& wo, const Columns& u);
  /// wi xyz -> the density of `visible`, zero where the half-vector is below the surface.
  std::vector<double> (*visible_pdf)(double alpha, const Direction& wo, const Columns& wi);
  /// cos, eta, k -> FresnelColumn; Schlick's with F0 and F90 from eta.
  Columns (*fresnel)(const Columns& in);
};

/// Every target this machine has: at full width, at one lane, and in double.
const std::vector<BsdfKernels>& AllBsdfKernels();

/// The best target: at full width in float, and in double.
const BsdfKernels& BestBsdfKernels();
const BsdfKernels& ReferenceBsdfKernels();

}  // namespace carpool::tests
