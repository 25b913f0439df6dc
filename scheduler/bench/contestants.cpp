// The same work through six schedulers.
#include "contestants.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/combinable.h>
#include <tbb/flow_graph.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_for_each.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "carpool/carpool.h"

namespace bench {
namespace {

Result add_up(tbb::combinable<Result>& parts) {
  return parts.combine([](Result a, const Result& b) { return a += b; });
}

// One arena per number of threads, for all contestants and runs: threads take a while to find a new
// one.
tbb::task_arena& arena_of(const Setup& setup) {
  static std::map<int, tbb::task_arena> arenas;
  return arenas.try_emplace(setup.threads, setup.threads).first->second;
}

carpool::RunOptions options_of(const Setup& setup) {
  carpool::RunOptions options{.in_flight = setup.in_flight};
  options.flush.count = setup.flush_count;
  if (setup.simulation != nullptr) {
    options.threads = static_cast<std::uint32_t>(setup.threads);
    options.mode = carpool::RunMode::simulated;
    options.simulation = *setup.simulation;
  } else {
    options.arena = &arena_of(setup);
  }
  return options;
}

}  // namespace

Result inlined_loop(const Work& work, const Setup& setup) {
  tbb::task_arena& arena = arena_of(setup);
  tbb::combinable<Result> parts;
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::uint64_t>(0, work.items, 512),
                      [&](const auto& range) {
                        const Work here = work;
                        Result part;
                        for (std::uint64_t id = range.begin(); id != range.end(); ++id) {
                          Item item = make_item(here, id);
                          part.visits += item.left;
                          while (item.left > 0) {
                            visit(here, item);
                          }
                          part.retire(item);
                        }
                        parts.local() += part;
                      });
  });
  return add_up(parts);
}

Result carpool_run(const Work& work, const Setup& setup) {
  carpool::RunReport report;
  return carpool_run(work, setup, report);
}

Result carpool_run(const Work& work, const Setup& setup, carpool::RunReport& report) {
  std::vector<Result> parts(static_cast<std::size_t>(setup.threads));
  std::vector<std::vector<Item>> scratch(parts.size(), std::vector<Item>(256));  // of each worker
  carpool::Graph graph;
  std::vector<carpool::StageHandle<Item>> stages;
  for (std::uint32_t s = 0; s < work.stages; ++s) {
    stages.push_back(
        graph.add_stage<Item>({.name = "stage", .bins = work.keys, .rank = static_cast<int>(s)}));
  }
  for (const auto stage : stages) {
    // Two loops: the first is what the waves do, and no branch in it waits for a hash.
    graph.set_kernel(stage, [&](const carpool::Batch<Item>& batch, carpool::Emitter& out) {
      const Work here = work;  // items are bytes to the compiler, which could be those of `work`
      Item* const moving = scratch[batch.worker].data();
      std::size_t count = 0;
      Result part;
      part.visits = batch.items.size();
      for (Item item : batch.items) {
        visit(here, item);
        if (item.left > 0) {
          moving[count++] = item;
        } else {
          part.retire(item);
        }
      }
      parts[batch.worker] += part;
      out.emit_each(std::span(moving, count), [&, to = stages.data()](const Item& item) {
        return std::pair(to[stage_of(here, item.hash)], key_of(here, item.hash));
      });
    });
  }
  std::atomic<std::uint64_t> next{0};
  graph.add_source(
      {.name = "items", .concurrency = 0}, [&](carpool::SourceContext& ctx, carpool::Emitter& out) {
        const std::uint64_t first = next.fetch_add(ctx.budget);
        const std::uint64_t last = std::min(work.items, first + ctx.budget);
        for (std::uint64_t id = first; id < last; ++id) {
          const Item item = make_item(work, id);
          out.emit(stages[stage_of(work, item.hash)], key_of(work, item.hash), item);
        }
        return last < work.items ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
      });
  report = carpool::run(graph, options_of(setup));
  Result sum;
  for (const Result& part : parts) {
    sum += part;
  }
  return sum;
}

std::uint64_t carpool_read(const BigTable& table, std::uint64_t items, const Setup& setup,
                           carpool::RunReport& report) {
  std::vector<Result> parts(static_cast<std::size_t>(setup.threads));
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint64_t>({.name = "read", .block_items = 64});
  graph.set_kernel(stage, [&](const carpool::Batch<std::uint64_t>& batch, carpool::Emitter&) {
    for (const std::uint64_t item : batch.items) {
      parts[batch.worker].sum += table.sum_of(item);
    }
  });
  std::atomic<std::uint64_t> next{0};
  graph.add_source(
      {.name = "items", .concurrency = 0}, [&](carpool::SourceContext& ctx, carpool::Emitter& out) {
        const std::uint64_t first = next.fetch_add(ctx.budget);
        const std::uint64_t last = std::min(items, first + ctx.budget);
        for (std::uint64_t id = first; id < last; ++id) {
          out.emit(stage, 0, make_item({}, id).hash >> 32);
        }
        return last < items ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
      });
  report = carpool::run(graph, options_of(setup));
  std::uint64_t sum = 0;
  for (const Result& part : parts) {
    sum += part.sum;
  }
  return sum;
}

// A parallel_for per hop over 4k items, no keys: the strongest simple rival.
Result waves(const Work& work, const Setup& setup) {
  constexpr std::uint64_t kWave = 4096;
  tbb::task_arena& arena = arena_of(setup);
  tbb::combinable<Result> parts;
  arena.execute([&] {
    std::vector<Item> items;
    for (std::uint64_t first = 0; first < work.items; first += kWave) {
      items.clear();
      for (std::uint64_t id = first; id < std::min(work.items, first + kWave); ++id) {
        items.push_back(make_item(work, id));
      }
      while (!items.empty()) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, items.size(), 256),
                          [&](const auto& range) {
                            const Work here = work;
                            Result part;
                            for (std::size_t i = range.begin(); i != range.end(); ++i) {
                              visit(here, items[i]);
                              ++part.visits;
                              if (items[i].left == 0) {
                                part.retire(items[i]);
                              }
                            }
                            parts.local() += part;
                          });
        std::erase_if(items, [](const Item& item) { return item.left == 0; });
      }
    }
  });
  return add_up(parts);
}

Result flow_graph(const Work& work, const Setup& setup) {
  using Node = tbb::flow::function_node<Item, tbb::flow::continue_msg>;
  tbb::task_arena& arena = arena_of(setup);
  tbb::combinable<Result> parts;
  arena.execute([&] {
    tbb::flow::graph graph;
    std::vector<std::unique_ptr<Node>> nodes;
    for (std::uint32_t s = 0; s < work.stages; ++s) {
      nodes.push_back(std::make_unique<Node>(graph, tbb::flow::unlimited, [&](Item item) {
        Result& mine = parts.local();
        visit(work, item);
        ++mine.visits;
        if (item.left > 0) {
          nodes[stage_of(work, item.hash)]->try_put(item);
        } else {
          mine.retire(item);
        }
      }));
    }
    for (std::uint64_t first = 0; first < work.items; first += setup.in_flight) {
      for (std::uint64_t id = first; id < std::min(work.items, first + setup.in_flight); ++id) {
        const Item item = make_item(work, id);
        nodes[stage_of(work, item.hash)]->try_put(item);
      }
      graph.wait_for_all();
    }
  });
  return add_up(parts);
}

Result feeder(const Work& work, const Setup& setup) {
  tbb::task_arena& arena = arena_of(setup);
  tbb::combinable<Result> parts;
  arena.execute([&] {
    std::vector<Item> items;
    for (std::uint64_t first = 0; first < work.items; first += setup.in_flight) {
      items.clear();
      for (std::uint64_t id = first; id < std::min(work.items, first + setup.in_flight); ++id) {
        items.push_back(make_item(work, id));
      }
      tbb::parallel_for_each(items.begin(), items.end(),
                             [&](const Item& from, tbb::feeder<Item>& out) {
                               Item item = from;
                               Result& mine = parts.local();
                               visit(work, item);
                               ++mine.visits;
                               if (item.left > 0) {
                                 out.add(item);
                               } else {
                                 mine.retire(item);
                               }
                             });
    }
  });
  return add_up(parts);
}

Result task_group(const Work& work, const Setup& setup) {
  tbb::task_arena& arena = arena_of(setup);
  tbb::combinable<Result> parts;
  arena.execute([&] {
    tbb::task_group group;
    struct Hop {
      const Work& work;
      tbb::combinable<Result>& parts;
      tbb::task_group& group;
      Item item;
      void operator()() const {
        Item next = item;
        Result& mine = parts.local();
        visit(work, next);
        ++mine.visits;
        if (next.left > 0) {
          group.run(Hop{work, parts, group, next});
        } else {
          mine.retire(next);
        }
      }
    };
    for (std::uint64_t first = 0; first < work.items; first += setup.in_flight) {
      for (std::uint64_t id = first; id < std::min(work.items, first + setup.in_flight); ++id) {
        group.run(Hop{work, parts, group, make_item(work, id)});
      }
      group.wait();
    }
  });
  return add_up(parts);
}

namespace {
constexpr std::uint32_t kLeaves = 64;
}

std::uint64_t carpool_fan_out(std::uint32_t roots, int threads, carpool::RunReport& report) {
  carpool::Graph graph;
  const auto split = graph.add_stage<std::uint32_t>({.name = "split", .rank = 0});
  const auto leaf = graph.add_stage<std::uint32_t>({.name = "leaf", .rank = 1, .weight = 1});
  graph.set_kernel(split, [&](const carpool::Batch<std::uint32_t>& batch, carpool::Emitter& out) {
    for (const std::uint32_t item : batch.items) {
      for (std::uint32_t i = 0; i < kLeaves; ++i) {
        out.emit(leaf, 0, item + i);
      }
    }
  });
  std::vector<Result> sums(static_cast<std::size_t>(threads));
  graph.set_kernel(leaf, [&](const carpool::Batch<std::uint32_t>& batch, carpool::Emitter&) {
    for (const std::uint32_t item : batch.items) {
      sums[batch.worker].sum += item;
    }
  });
  std::uint32_t next = 0;
  graph.add_source({.name = "roots", .fan_out = kLeaves}, [&](carpool::SourceContext& ctx,
                                                              carpool::Emitter& out) {
    for (std::uint32_t i = 0; i < ctx.budget && next < roots; ++i, ++next) {
      out.emit(split, 0, next);
    }
    return next < roots ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
  });
  report =
      carpool::run(graph, {.threads = static_cast<std::uint32_t>(threads), .in_flight = 16384});
  std::uint64_t sum = 0;
  for (const Result& part : sums) {
    sum += part.sum;
  }
  return sum;
}

std::uint64_t flow_graph_fan_out(std::uint32_t roots, int threads) {
  tbb::task_arena arena(threads);
  tbb::combinable<Result> parts;
  arena.execute([&] {
    tbb::flow::graph graph;
    tbb::flow::function_node<std::uint32_t, tbb::flow::continue_msg> leaf(
        graph, tbb::flow::unlimited, [&](std::uint32_t item) { parts.local().sum += item; });
    tbb::flow::function_node<std::uint32_t, tbb::flow::continue_msg> split(
        graph, tbb::flow::unlimited, [&](std::uint32_t item) {
          for (std::uint32_t i = 0; i < kLeaves; ++i) {
            leaf.try_put(item + i);
          }
        });
    for (std::uint32_t root = 0; root < roots; ++root) {
      split.try_put(root);
    }
    graph.wait_for_all();
  });
  return add_up(parts).sum;
}

}  // namespace bench
