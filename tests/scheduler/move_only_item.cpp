// Must not compile: items have to be trivially copyable. A CTest entry looks for the advice in the
// compiler's message.
#include <memory>

#include "carpool/carpool.h"

int main() {
  carpool::Graph graph;
  graph.add_stage<std::unique_ptr<int>>({.name = "owner"});
}
