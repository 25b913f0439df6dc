// The graph: read -> decode -> shrink -> encode -> write, the first and the last of which wait for
// disks, not for cores.
#include "thumbnails.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <vector>

#include "files.h"
#include "image.h"

namespace {

using Stage = carpool::StageHandle<std::uint32_t>;
using Batch = carpool::Batch<std::uint32_t>;

// An item is the number of a job: small, as items should be. What is large is here, and only while
// the job is in flight.
struct Job {
  FilePair files;
  Bytes bytes = {};  // of the image, later of the thumbnail
  Image image = {};
};

// Maker holds the jobs, and the graph that does them.
class Maker {
 public:
  explicit Maker(const ThumbnailOptions& options) : options_(options) {
    for (FilePair& files : list_images(options.from, options.to)) {
      jobs_.push_back({.files = std::move(files)});
    }
    add_steps();
    add_source();
  }
  ThumbnailSummary run();

 private:
  enum class Next { go_on, over };

  Stage add_stage(const char* name, int rank, std::uint32_t threads);
  void add_steps();
  void add_source();
  template <class Step>
  void add_step(Stage from, const Stage* next, Step step);
  void report_bad(const Job& job, const char* reason);
  std::uint64_t done() const { return made_ + up_to_date_ + bad_; }

  const ThumbnailOptions& options_;
  std::vector<Job> jobs_;
  carpool::Graph graph_;
  Stage read_;
  std::uint32_t next_ = 0;  // job to begin
  std::atomic<std::uint64_t> made_{0}, up_to_date_{0}, bad_{0};
  std::mutex bad_mutex_;
};

// One image is a batch: it is much work. Stages with threads of their own block. The nearer to the
// end the higher the rank, so that few images wait decoded, which is when they are large.
Stage Maker::add_stage(const char* name, int rank, std::uint32_t threads) {
  return graph_.add_stage<std::uint32_t>({.name = name,
                                          .block_items = 1,
                                          .rank = rank,
                                          .concurrency = threads,
                                          .blocking = threads != 0});
}

// `next` gets the job if the step says so. A bad image ends here.
template <class Step>
void Maker::add_step(Stage from, const Stage* next, Step step) {
  const Stage to = next != nullptr ? *next : from;
  const bool goes_on = next != nullptr;
  graph_.set_kernel(from, [this, to, goes_on, step](const Batch& batch, carpool::Emitter& out) {
    Job& job = jobs_[batch.items.front()];
    try {
      if (step(job) == Next::go_on && goes_on) {
        out.emit(to, 0, batch.items);
        return;
      }
    } catch (const WriteError&) {
      throw;  // the next one could not be written either
    } catch (const std::exception& error) {
      report_bad(job, error.what());
    }
    job.bytes = {};  // this job is over
    job.image = {};
  });
  if (goes_on) {
    graph_.add_edge(from, to);
  }
}

void Maker::add_steps() {
  const std::uint32_t readers = std::max(1U, options_.readers);
  read_ = add_stage("read", 0, readers);
  const Stage decode_stage = add_stage("decode", 1, 0);
  const Stage shrink_stage = add_stage("shrink", 2, 0);
  const Stage encode_stage = add_stage("encode", 3, 0);
  const Stage write = add_stage("write", 4, std::max(1U, readers / 2));
  add_step(read_, &decode_stage, [this](Job& job) {
    if (is_up_to_date(job.files)) {
      ++up_to_date_;
      return Next::over;
    }
    job.bytes = read_file(job.files.from);
    return Next::go_on;
  });
  add_step(decode_stage, &shrink_stage, [](Job& job) {
    job.image = decode(job.bytes);
    job.bytes = {};
    return Next::go_on;
  });
  add_step(shrink_stage, &encode_stage, [this](Job& job) {
    job.image = shrink(job.image, options_.size);
    return Next::go_on;
  });
  add_step(encode_stage, &write, [](Job& job) {
    job.bytes = encode(job.image);
    job.image = {};
    return Next::go_on;
  });
  add_step(write, nullptr, [this](Job& job) {
    write_file(job.files.to, job.bytes);
    ++made_;
    return Next::over;
  });
}

void Maker::add_source() {
  const auto files = graph_.add_source({.name = "files"}, [this](carpool::SourceContext& source,
                                                                 carpool::Emitter& out) {
    for (std::uint32_t i = 0; i < source.budget && next_ < jobs_.size(); ++i) {
      out.emit(read_, 0, next_++);
    }
    return next_ < jobs_.size() ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
  });
  graph_.add_edge(files, read_);
}

void Maker::report_bad(const Job& job, const char* reason) {
  ++bad_;
  const std::lock_guard guard(bad_mutex_);
  if (options_.on_bad) {
    options_.on_bad(job.files.from, reason);
  }
}

ThumbnailSummary Maker::run() {
  carpool::RunOptions run = options_.run;
  run.in_flight = options_.in_flight;  // one credit an image: that bounds the memory
  if (options_.on_progress) {
    run.progress = [this](const carpool::Progress&) { options_.on_progress(done(), jobs_.size()); };
  }
  ThumbnailSummary summary;
  summary.report = carpool::run(graph_, run);
  summary.made = made_;
  summary.up_to_date = up_to_date_;
  summary.bad = bad_;
  summary.left = jobs_.size() - done();
  return summary;
}

}  // namespace

ThumbnailSummary make_thumbnails(const ThumbnailOptions& options) {
  return Maker(options).run();
}
