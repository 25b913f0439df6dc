// Figures of a benchmark: a table for people, rows of JSON for scripts, a plot to look at.
#pragma once

#include <string>
#include <vector>

namespace bench {

// Rows prints each figure as soon as it is measured, and collects them.
class Rows {
 public:
  void add(const std::string& name, double value, const char* unit);
  void at_most(const std::string& name, double value, const char* unit, double target);
  void at_least(const std::string& name, double value, const char* unit, double target);

  // bar adds one bar to a group of the plot: what a visit costs over the loop.
  void bar(const std::string& group, const std::string& contestant, double nanoseconds);

  // These return false if the file cannot be written.
  bool write_json(const std::string& path) const;
  bool write_plot(const std::string& path) const;

 private:
  enum class Bound { none, most, least };
  struct Row {
    std::string name;
    double value;
    std::string unit;
    Bound bound;
    double target;
    bool holds() const;
    void print() const;
  };
  struct Bar {
    std::string group;
    std::string contestant;
    double nanoseconds;
  };

  void add(Row row);

  std::vector<Row> rows_;
  std::vector<Bar> bars_;
};

}  // namespace bench
