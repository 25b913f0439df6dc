// Ray recording by waves and replay through bare Embree.
#include "tools/bench/replay.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <numeric>

#include "stages/executors/camera_group.h"
#include "stages/simd/denormals.h"
#include "stages/tracing/packet_size.h"

namespace carpool::tools {
namespace {

using stages::CameraRays;
using stages::KernelContext;
using stages::Next;
using stages::PathState;

constexpr uint32_t kWindow = 1u << 16;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Follows one window of paths wave by wave.
class Window {
 public:
  Window(const KernelContext& c, const stages::Kernels& kernels, RayLog& log)
      : c_(c), kernels_(kernels), opacity_{&c, kernels.opacity}, log_(log), paths_(kWindow) {}

  void Add(const stages::CameraPacket& packet) {
    stages::AddGroup(c_, packet, rays_);
    if (rays_.count == CameraRays::kMost) Trace();
    if (count_ + CameraRays::kMost > kWindow) Follow();
  }

  void Finish() {
    if (rays_.count > 0) Trace();
    Follow();
  }

 private:
  void Trace() {
    kernels_.wide.camera(c_, rays_);
    log_.camera.push_back(rays_);
    stages::IntersectCameraRays(c_.trace, rays_);
    for (uint32_t i = 0; i < rays_.count; ++i) {
      if (rays_.inside[i] != 0) StartPath(rays_, i, paths_[count_++]);
    }
    rays_.count = 0;
  }

  void Follow() {
    std::vector<uint32_t> active(count_);
    std::iota(active.begin(), active.end(), 0u);
    while (!active.empty()) active = Wave(active);
    log_.samples += count_;
    count_ = 0;
  }

  std::vector<uint32_t> Wave(const std::vector<uint32_t>& active) {
    std::vector<uint32_t> hits, on;
    for (const uint32_t slot : active) {
      if (paths_[slot].placement >= 0) hits.push_back(slot);
    }
    std::vector<Next> next(hits.size());
    if (!hits.empty()) kernels_.wide.shade(c_, paths_.data(), hits, next.data());
    for (size_t i = 0; i < hits.size(); ++i) {
      PathState& path = paths_[hits[i]];
      if (next[i] == Next::shadow) {
        log_.shadow.push_back(RayOf(path, path.shadow_direction, 0, path.shadow_distance));
        stages::TraceShadow(c_.trace, opacity_, path);
        next[i] = (path.flags & stages::kPathAlive) != 0 ? Next::trace : Next::film;
      }
      if (next[i] == Next::trace) on.push_back(hits[i]);
    }
    for (const uint32_t slot : on) {
      PathState& path = paths_[slot];
      log_.bounce.push_back(RayOf(path, path.direction, path.tnear, kInfinity));
      stages::IntersectPath(c_.trace, path);
    }
    return on;
  }

  static RecordedRay RayOf(const PathState& p, const float direction[3], float tnear, float tfar) {
    return {{p.origin[0], p.origin[1], p.origin[2]},
            {direction[0], direction[1], direction[2]},
            tnear,
            tfar};
  }

  const KernelContext& c_;
  const stages::Kernels& kernels_;
  stages::OpacityQuery opacity_;
  RayLog& log_;
  CameraRays rays_;  // that are still to be traced
  std::vector<PathState> paths_;
  uint32_t count_ = 0;
};

uint64_t SpreadBits(uint64_t v) {  // 10 bits to every third of 30
  v = (v | v << 16) & 0x030000FF;
  v = (v | v << 8) & 0x0300F00F;
  v = (v | v << 4) & 0x030C30C3;
  return (v | v << 2) & 0x09249249;
}

void SortWindow(RecordedRay* first, size_t count) {
  float low[3] = {kInfinity, kInfinity, kInfinity}, high[3] = {-kInfinity, -kInfinity, -kInfinity};
  for (size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], first[i].origin[c]);
      high[c] = std::max(high[c], first[i].origin[c]);
    }
  }
  std::vector<std::pair<uint64_t, uint32_t>> keys(count);
  for (size_t i = 0; i < count; ++i) {
    uint64_t key = 0, octant = 0;
    for (int c = 0; c < 3; ++c) {
      const float extent = std::max(high[c] - low[c], 1e-20f);
      const auto cell = static_cast<uint64_t>(
          std::min((first[i].origin[c] - low[c]) / extent * 1024.0f, 1023.0f));
      key |= SpreadBits(cell) << c;
      octant |= (first[i].direction[c] < 0 ? 1u : 0u) << c;
    }
    keys[i] = {octant << 30 | key, static_cast<uint32_t>(i)};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<RecordedRay> sorted(count);
  for (size_t i = 0; i < count; ++i) sorted[i] = first[keys[i].second];
  std::copy(sorted.begin(), sorted.end(), first);
}

void SetRay(RTCRay& ray, const RecordedRay& r) {
  ray = {r.origin[0],
         r.origin[1],
         r.origin[2],
         r.tnear,
         r.direction[0],
         r.direction[1],
         r.direction[2],
         0,
         r.tfar,
         ~0u,
         0,
         0};
}

void ReplayBounce(const stages::TraceView& view, const RecordedRay& r) {
  RTCRayHit hit;
  SetRay(hit.ray, r);
  for (RTCScene scene : {view.opaque.scene, view.transparent.scene}) {  // the second up to the hit
    if (scene == nullptr) continue;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    stages::EmbreeIntersect1(scene, &hit);
  }
}

void ReplayShadow(const stages::TraceView& view, const RecordedRay& r) {
  RTCRay ray;
  SetRay(ray, r);
  if (view.opaque.scene != nullptr) stages::EmbreeOccluded1(view.opaque.scene, &ray);
  if (view.transparent.scene != nullptr && ray.tfar >= 0) {
    SetRay(ray, r);
    stages::EmbreeOccluded1(view.transparent.scene, &ray);
  }
}

template <int kSize, class Rays>
void SetRays(Rays& rays, const RecordedRay* first, size_t count) {
  for (size_t i = 0; i < kSize; ++i) {
    const RecordedRay& r = first[std::min(i, count - 1)];
    rays.org_x[i] = r.origin[0];
    rays.org_y[i] = r.origin[1];
    rays.org_z[i] = r.origin[2];
    rays.dir_x[i] = r.direction[0];
    rays.dir_y[i] = r.direction[1];
    rays.dir_z[i] = r.direction[2];
    rays.tnear[i] = r.tnear;
    rays.tfar[i] = r.tfar;
    rays.time[i] = 0;
    rays.mask[i] = ~0u;
    rays.id[i] = 0;
    rays.flags[i] = 0;
  }
}

/// Calls trace(first, count, valid) for each packet of the rays.
template <int kSize, class Trace>
void InPackets(const RecordedRay* rays, size_t count, const Trace& trace) {
  for (size_t i = 0; i < count; i += kSize) {
    const size_t some = std::min<size_t>(kSize, count - i);
    alignas(64) int valid[kSize] = {};
    std::fill_n(valid, some, -1);
    trace(rays + i, some, valid);
  }
}

template <int kSize>
void ReplayBouncePackets(const stages::TraceView& view, const RecordedRay* rays, size_t count) {
  InPackets<kSize>(rays, count, [&](const RecordedRay* first, size_t some, const int* valid) {
    typename stages::EmbreePacket<kSize>::RayHit hits;
    SetRays<kSize>(hits.ray, first, some);
    for (RTCScene scene : {view.opaque.scene, view.transparent.scene}) {
      if (scene == nullptr) continue;
      std::fill_n(hits.hit.geomID, kSize, RTC_INVALID_GEOMETRY_ID);
      std::fill_n(hits.hit.instID[0], kSize, RTC_INVALID_GEOMETRY_ID);
      stages::EmbreeIntersect<kSize>(valid, scene, &hits, stages::Coherence::incoherent);
    }
  });
}

template <int kSize>
void ReplayShadowPackets(const stages::TraceView& view, const RecordedRay* rays, size_t count) {
  InPackets<kSize>(rays, count, [&](const RecordedRay* first, size_t some, int* valid) {
    typename stages::EmbreePacket<kSize>::Ray packet;
    SetRays<kSize>(packet, first, some);
    if (view.opaque.scene != nullptr)
      stages::EmbreeOccluded<kSize>(valid, view.opaque.scene, &packet);
    if (view.transparent.scene == nullptr) return;
    for (size_t i = 0; i < some; ++i) valid[i] = packet.tfar[i] < 0 ? 0 : -1;
    stages::EmbreeOccluded<kSize>(valid, view.transparent.scene, &packet);
  });
}

}  // namespace

RayLog RecordRays(const KernelContext& context, const stages::Kernels& kernels, uint32_t samples) {
  const stages::FlushDenormals denormals;
  RayLog log;
  Window window(context, kernels, log);
  stages::CameraWork work(context.width, context.height,
                          {.first_sample = 0, .sample_count = samples});
  while (work.Claim(0, 1024, [&](const stages::CameraPacket& packet) { window.Add(packet); })) {
  }
  window.Finish();
  return log;
}

double Replay(const stages::TraceView& view, const RayLog& log, const ReplayWay& way,
              tbb::task_arena& arena) {
  std::vector<RecordedRay> bounce = log.bounce, shadow = log.shadow;
  std::vector<CameraRays> camera = log.camera;
  const auto begin = std::chrono::steady_clock::now();
  arena.execute([&] {
    const auto in_chunks = [](size_t count, size_t chunk, const auto& body) {
      tbb::parallel_for(size_t{0}, (count + chunk - 1) / chunk, [&](size_t i) {
        const stages::FlushDenormals denormals;
        body(i * chunk, std::min(count, (i + 1) * chunk));
      });
    };
    in_chunks(camera.size(), 8, [&](size_t first, size_t last) {
      for (size_t i = first; i < last; ++i) stages::IntersectCameraRays(view, camera[i]);
    });
    constexpr size_t kSortWindow = size_t{1} << 18;
    for (std::vector<RecordedRay>* rays : {&bounce, &shadow}) {
      if (way.sorted)
        in_chunks(rays->size(), kSortWindow, [&](size_t first, size_t last) {
          SortWindow(rays->data() + first, last - first);
        });
    }
    if (way.packets) {
      stages::WithPacketSize(view.packet_size, [&](auto size) {
        in_chunks(bounce.size(), 512, [&](size_t first, size_t last) {
          ReplayBouncePackets<size()>(view, &bounce[first], last - first);
        });
        in_chunks(shadow.size(), 512, [&](size_t first, size_t last) {
          ReplayShadowPackets<size()>(view, &shadow[first], last - first);
        });
      });
      return;
    }
    in_chunks(bounce.size(), 512, [&](size_t first, size_t last) {
      for (size_t i = first; i < last; ++i) ReplayBounce(view, bounce[i]);
    });
    in_chunks(shadow.size(), 512, [&](size_t first, size_t last) {
      for (size_t i = first; i < last; ++i) ReplayShadow(view, shadow[i]);
    });
  });
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace carpool::tools
