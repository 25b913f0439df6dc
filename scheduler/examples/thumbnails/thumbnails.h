// A folder of images becomes a folder of thumbnails.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "carpool/carpool.h"

struct ThumbnailOptions {
  std::filesystem::path from;    // read with all its folders; .png, .jpg and .jpeg
  std::filesystem::path to;      // a/b.png becomes a/b.png.jpg in here
  std::uint32_t size = 256;      // pixels of the longer side
  std::uint32_t in_flight = 32;  // images in memory at once
  std::uint32_t readers = 4;     // threads that read, and half as many that write
  carpool::RunOptions run = {};

  // Called by one thread at a time: for each bad file, and now and then with how far things are.
  std::function<void(const std::filesystem::path&, const std::string& reason)> on_bad = {};
  std::function<void(std::uint64_t done, std::uint64_t all)> on_progress = {};
};

struct ThumbnailSummary {
  std::uint64_t made = 0;
  std::uint64_t up_to_date = 0;  // there was one that is newer than the image
  std::uint64_t bad = 0;         // reported and skipped
  std::uint64_t left = 0;        // because the run was ended early
  carpool::RunReport report = {};
};

/// make_thumbnails does what is not done yet. A thumbnail appears in full or not at all, so that it
/// may be stopped and started again at any time. At most `in_flight` images are in memory, of which
/// about one per thread is decoded. Throws ReadError or WriteError (files.h) if a folder cannot be
/// read or a thumbnail not be written, and std::invalid_argument if both folders are the same.
ThumbnailSummary make_thumbnails(const ThumbnailOptions& options);
