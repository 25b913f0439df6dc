/* The protocol by which workers sleep, are woken, steal, end and cancel a run, for the model checker spin.
 *
 * README.md maps each inline below to the function of scheduler/src that it mirrors, and says what is left out.
 * Every sequentially consistent read-modify-write is one atomic step. The stores to a queue's size go through a
 * store buffer of one entry per thread, which empties at any later time; a fence waits until it is empty. What
 * follows a fence in the code waits here, too; what does not may be overtaken.
 *
 * Parameters: SEATS, HELPERS (threads beside the caller), ROOTS (items that the source has), CREDITS, WEIGHT (of a
 * root's children), POCKET (credits a worker may keep).
 * Variants: WAIT (the kernel of the first root waits until somebody has taken what it published), BOTH_WAIT (that of
 * the second waits for the first), END (the run may be cancelled, and kernels may throw, at any moment), ONE_CHILD
 * and COARSE (queues are pushed to, searched and taken from in one step each), for a smaller number of states.
 * Mistakes (MISTAKE_...): each must be found; see CMakeLists.txt.
 */
#ifndef SEATS
#define SEATS 2
#endif
#ifndef HELPERS
#define HELPERS (SEATS - 1)
#endif
#ifndef ROOTS
#define ROOTS 2
#endif
#ifndef CREDITS
#define CREDITS 2
#endif
#ifndef WEIGHT
#define WEIGHT 1
#endif
#ifndef POCKET
#define POCKET 1
#endif
mtype:work = { NOTHING, SOURCE, ROOT, CHILD, CALLER, HELPER };
#define CHARGE 2
#ifdef ONE_CHILD
#define CHILDREN 1
#else
#define CHILDREN 2
#endif
#define NOBODY 255
#define FIRST_HELPER 2  /* processes are numbered as they stand: Memory, Caller, helpers */

/* Gate: the word of state. */
byte present = 1, searching, invited;
bool caller_asleep, closed;
/* Gate: the rest. */
bool stopped;
bit signal;
bool seat_free[SEATS] = true;
byte shown[SEATS];     /* ready_size, as in memory */

/* ReadyQueue and OpenTable of each seat: how many blocks, of roots and of children. */
bool locked[SEATS];
byte ready_roots[SEATS], ready_children[SEATS];
byte open_roots[SEATS], open_children[SEATS];
#define ready(seat) (ready_roots[seat] + ready_children[seat])

/* Credits, and CreditCache of each seat. */
short purse = CREDITS;
short pocket[SEATS];

/* The source: one worker at a time, one root per call. */
byte inside, born;
bool exhausted;

/* The arena's queue of invitations. */
byte posted;

/* Store buffers: by thread, the seat of the queue whose new size, and unlocking, is not in memory yet. */
byte buffered[HELPERS + 1] = NOBODY;

/* What only the checks know. */
byte live, retired, kernels_running;
byte late_calls[SEATS];
bool cancelled, returned, first_root_ran, first_root_done;

#define fence(me) (buffered[me] == NOBODY)
#define hungry() (searching == 0 && present + invited < SEATS && !closed)

/* Memory empties the store buffers, whenever it likes. */
inline flush(thread) {
  d_step {
    buffered[thread] != NOBODY ->
    shown[buffered[thread]] = ready(buffered[thread]);
    locked[buffered[thread]] = false;
    buffered[thread] = NOBODY
  }
}

active proctype Memory() {
end:
  do
  :: flush(0)
  :: flush(1)
#if HELPERS > 1
  :: flush(2)
#endif
  od
}

/* ---- SpinLock and ReadyQueue ---- */

inline lock(seat_of_queue) { atomic { fence(me) && !locked[seat_of_queue] -> locked[seat_of_queue] = true } }
/* Stores the new size and unlocks: both leave the buffer at once, the size first. */
#ifdef COARSE
inline store_size_and_unlock(seat_of_queue) { shown[seat_of_queue] = ready(seat_of_queue); locked[seat_of_queue] = false }
#else
inline store_size_and_unlock(seat_of_queue) { buffered[me] = seat_of_queue }
#endif

inline push(is_root) {
#ifndef COARSE
  lock(seat);
#endif
  d_step {
    if
    :: is_root -> ready_roots[seat]++
    :: else -> ready_children[seat]++
    fi;
    store_size_and_unlock(seat)
  }
#ifndef MISTAKE_BUFFERED_SIZE
  fence(me)              /* the store is sequentially consistent */
#endif
}

/* Takes a block from a locked queue, if there is one, into `hand`. */
inline unlink(seat_of_queue) {
  d_step {
    if
    :: ready_children[seat_of_queue] > 0 -> ready_children[seat_of_queue]--; hand = CHILD
    :: else ->
      if
      :: ready_roots[seat_of_queue] > 0 -> ready_roots[seat_of_queue]--; hand = ROOT
      :: else
      fi
    fi;
    store_size_and_unlock(seat_of_queue)
  }
}

inline take_ready() {
  if
#ifdef COARSE
  :: atomic { shown[seat] != 0 -> unlink(seat) }
#else
  :: shown[seat] != 0 || buffered[me] == seat -> lock(seat); unlink(seat)   /* an owner sees its own stores */
#endif
  :: else
  fi
}

#ifdef COARSE
inline steal() {
  d_step {
    victim = 0;
    do
    :: victim < SEATS && (victim == seat || shown[victim] == 0) -> victim++
    :: victim < SEATS && victim != seat && shown[victim] != 0 -> unlink(victim); break
    :: victim == SEATS -> break
    od;
    victim = 0
  }
}
#else
inline steal() {
  victim = 0;
  do
  :: victim == SEATS -> break
  :: victim < SEATS && (victim == seat || shown[victim] == 0) -> victim++
  :: else ->
    if
    :: atomic { fence(me) && !locked[victim] -> locked[victim] = true };
      unlink(victim);
      if
      :: hand != NOTHING -> break
      :: else -> victim++
      fi
    :: locked[victim] -> victim++       /* try_lock fails */
    fi
  od;
  victim = 0
}
#endif

/* ---- Gate ---- */

/* found: whether any queue shows a block; one load after the other. */
inline any_ready() {
#ifdef COARSE
  atomic {
#endif
  found = false;
  victim = 0;
  do
  :: victim < SEATS && shown[victim] != 0 -> found = true; break
  :: victim < SEATS && shown[victim] == 0 -> victim++
  :: victim == SEATS -> break
  od;
  victim = 0
#ifdef COARSE
  }
#endif
}

inline invite() {
  atomic {
    fence(me);
    if
    :: hungry() && caller_asleep -> invited++; caller_asleep = false; call = CALLER
    :: hungry() && !caller_asleep -> invited++; call = HELPER
    :: else
    fi
  }
  if
  :: call == CALLER -> atomic { signal = 1; call = NOTHING }
  :: call == HELPER -> atomic { posted++; call = NOTHING }      /* Summoner::summon */
  :: else
  fi
}

inline enter(let_in) {
  atomic {
    fence(me);
    if
    :: closed -> let_in = false
    :: else -> invited--; present++; searching++; let_in = true
    fi
  }
}

inline take_seat() {
  atomic {
    seat = 0;
    do
    :: seat < SEATS && seat_free[seat] -> seat_free[seat] = false; break
    :: seat < SEATS && !seat_free[seat] -> seat++
    :: seat == SEATS -> assert(false)  /* there is always a seat for who has an active place */
    od
  }
}

inline release_seat() { seat_free[seat] = true }

inline leave() {
#ifdef MISTAKE_EARLY_LOOK
  any_ready();           /* loads that overtake the announcement */
#endif
  atomic {
    fence(me);
    present--;
    searching--;
    if
    :: present == 0 -> closed = true; closes = true
    :: present > 0 && is_caller -> caller_asleep = true
    :: else
    fi
  }
#ifdef MISTAKE_SEAT_LATE
  release_seat();
#endif
  stays = false;
  if
  :: closes ->
#ifndef MISTAKE_NO_LAST_SIGNAL
    signal = 1
#endif
  :: else ->
#ifndef MISTAKE_EARLY_LOOK
    found = false;
#ifndef MISTAKE_NO_LOOK_BACK
    if
    :: !stopped -> any_ready()
    :: else
    fi;
#endif
#endif
    if
    :: found -> come_back()
    :: else
    fi
  fi;
  found = false
}

inline come_back() {
  atomic {
    if
    :: closed || (is_caller && !caller_asleep) || present + invited >= SEATS
    :: else ->
      present++;
      searching++;
      if
      :: is_caller -> caller_asleep = false
      :: else
      fi;
      stays = true
    fi
  }
}

/* ---- Credits and CreditCache ---- */

inline settle(change) {
  pocket[seat] = pocket[seat] + (change);
  if
  :: pocket[seat] > POCKET -> atomic { fence(me); purse = purse + pocket[seat]; pocket[seat] = 0 }
  :: pocket[seat] < 0 -> atomic { fence(me); purse = purse + pocket[seat]; pocket[seat] = 0 }
  :: else
  fi
}

inline return_all() {
  if
  :: pocket[seat] > 0 -> atomic { fence(me); purse = purse + pocket[seat]; pocket[seat] = 0 }
  :: else
  fi
}

/* ---- RunCore and its source ---- */

inline source_ready() {
  found = !exhausted && inside == 0;
  if
  :: found -> found = purse >= CHARGE
  :: else
  fi
}

inline check_end() {
  if
  :: cancelled -> stopped = true
  :: else
  fi
}

inline take_source() {
  if
  :: !exhausted && pocket[seat] + purse >= CHARGE ->
    atomic {             /* try_enter_source */
      fence(me);
      if
      :: inside == 0 -> inside = 1; found = true
      :: else -> found = false
      fi
    }
    if
    :: found && exhausted -> inside = 0
    :: found && !exhausted ->
      atomic {           /* CreditCache::reserve */
        if
        :: pocket[seat] + purse >= CHARGE && pocket[seat] < CHARGE ->
          purse = purse - (CHARGE - pocket[seat]);
          pocket[seat] = CHARGE;
          hand = SOURCE
        :: pocket[seat] >= CHARGE -> hand = SOURCE
        :: else
        fi
      }
      if
      :: hand == NOTHING -> inside = 0
      :: else
      fi
    :: else
    fi;
    found = false
  :: else
  fi
}

/* ---- Worker ---- */

inline take_open() {
  d_step {
    if
    :: open_children[seat] > 0 -> open_children[seat]--; hand = CHILD
    :: else ->
      if
      :: open_roots[seat] > 0 -> open_roots[seat]--; hand = ROOT
      :: else
      fi
    fi
  }
}

inline publish(is_root) {
#ifndef MISTAKE_SETTLE_LATE
  settle(-spent);
  spent = 0;
#endif
#ifdef MISTAKE_VIEW_FIRST
  found = hungry();
  push(is_root);
#else
  push(is_root);
  found = hungry();      /* one load of the state */
#endif
  if
  :: found -> invite()
  :: else
  fi;
  found = false
}

inline acquire() {
  hand = NOTHING;
  take_ready();
  if
  :: hand == NOTHING ->
    if
    :: take_source()     /* credits are plenty; or not, by a threshold that is not modelled */
    :: skip
    fi
  :: else
  fi;
  if
  :: hand == NOTHING -> steal()
  :: else
  fi;
  if
  :: hand == NOTHING -> take_open()
  :: else
  fi;
  if
  :: hand == NOTHING -> take_source()
  :: else
  fi
}

inline found_work() {
  is_searching = false;
  atomic { fence(me); searching--; found = hungry() }
#ifndef MISTAKE_QUIET_FINDER
  if
  :: found ->
    any_ready();
    if
    :: found -> invite()
    :: else
    fi
  :: else
  fi;
#endif
  found = false
}

/* A root becomes two children: the first is published at once, the second stays open. */
inline run_root() {
#ifdef BOTH_WAIT
  if
  :: first_root_ran -> first_root_done || stopped
  :: !first_root_ran
  fi;
#endif
  spent = WEIGHT;
  grow();
  publish(false);
#ifdef WAIT
  if
  :: atomic { !first_root_ran -> first_root_ran = true }; ready_children[seat] == 0 || stopped; first_root_done = true
  :: first_root_ran
  fi;
#endif
#ifndef ONE_CHILD
  spent = spent + WEIGHT;
  grow();
  open_children[seat]++;
#endif
  live--;
  settle(CHARGE - spent);
  spent = 0
}

inline run_child() {
  live--;
  retired++;
  settle(WEIGHT)
}

inline grow() {
  d_step {
    live++;
    assert(live <= CREDITS + kernels_running)  /* the bound; a running kernel's own items are extra */
  }
}

inline call_source() {
  d_step { born++; live++; open_roots[seat]++; assert(live <= CREDITS + kernels_running) }
  settle(-CHARGE);
  if
  :: born == ROOTS -> exhausted = true
  :: else
  fi;
  inside = 0
}

inline perform() {
  d_step {
    assert(!returned);   /* nothing runs after run() has returned */
    if
    :: cancelled -> late_calls[seat]++
    :: else
    fi;
    assert(late_calls[seat] <= 1);       /* cancel is bounded by one call per worker */
  }
  if
  :: hand == SOURCE -> call_source()
  :: hand == ROOT -> kernels_running++; run_root(); kernels_running--
  :: hand == CHILD -> kernels_running++; run_child(); kernels_running--
  fi;
  hand = NOTHING;
#ifndef MISTAKE_NO_CHECK
  check_end();
#endif
  if
  :: searching != 0 || hungry() -> share()
  :: else
  fi
}

inline share() {
  if
  :: ready(seat) == 0 && open_roots[seat] + open_children[seat] >= 2 ->  /* half of them; here, one */
    if
    :: open_children[seat] > 0 -> open_children[seat]--; publish(false)
    :: open_children[seat] == 0 -> open_roots[seat]--; publish(true)
    :: skip              /* not so soon after an offer that was in vain */
    fi
  :: ready(seat) != 0 -> invite()
  :: else ->
    source_ready();
    if
    :: found -> invite()
    :: else
    fi;
    found = false
  fi
}

/* go_on: whether to look for work again. */
inline search() {
#ifdef MISTAKE_CREDITS_LATE
  source_ready();
  return_all();
#else
  return_all();
#endif
  if
  :: !is_searching -> is_searching = true; atomic { fence(me); searching++ }
  :: else
  fi;
#ifndef MISTAKE_CREDITS_LATE
  source_ready();
#endif
  go_on = found;
  do
  :: go_on -> break
  :: !go_on -> break     /* time is up */
  :: !go_on && !stopped && present > searching ->
    any_ready();
    if
    :: found -> go_on = true
    :: else -> source_ready(); go_on = found
    fi
  :: !go_on && (stopped || present <= searching) -> break
  od;
  found = false
}

inline serve() {
  check_end();           /* begin_shift */
  do
  :: stopped -> break
  :: else ->
    acquire();
    if
    :: hand != NOTHING ->
      if
      :: is_searching -> found_work()
      :: else
      fi;
      perform()
#ifdef END
    :: hand != NOTHING && hand != SOURCE -> stopped = true; hand = NOTHING; break      /* the kernel throws */
#endif
    :: hand == NOTHING ->
      search();
      if
      :: go_on
      :: else -> break
      fi
    fi
  od;
  return_all();          /* end_shift */
  if
  :: !is_searching -> atomic { fence(me); searching++ }
  :: else
  fi;
#ifndef MISTAKE_SEAT_LATE
  release_seat();
#endif
  is_searching = true
}

/* ---- Threads: run(), and the invitations that helpers get ---- */


#define LOCALS(caller)                                                                \
  mtype:work hand = NOTHING, call = NOTHING;                                          \
  byte seat, victim, spent;                                                           \
  bool is_searching, found, go_on, stays, closes, may_enter;                          \
  bool is_caller = caller

active proctype Caller() {
  byte me = 0;
  LOCALS(true);
  do
  ::
    do
    :: take_seat(); serve(); leave();
      if
      :: stays
      :: else -> break
      fi
    od;
#ifdef MISTAKE_EARLY_RESET
    signal = 0;
#endif
    signal == 1;         /* wait_for_invitation */
    if
    :: closed -> break
    :: else
    fi;
    signal = 0;
    enter(may_enter);
    if
    :: may_enter
    :: else -> break
    fi
  od;
  atomic {
    returned = true;
    assert(present == 0 && closed && kernels_running == 0);
    if
    :: !stopped ->       /* every item has been handled, every credit is back */
      assert(exhausted && born == ROOTS && retired == CHILDREN * ROOTS && live == 0);
      assert(purse == CREDITS);
    :: else
    fi
  }
}

active [HELPERS] proctype Helper() {
  byte me = _pid - FIRST_HELPER + 1;
  LOCALS(false);
end:
  do
  :: atomic { posted > 0 -> posted-- };
    enter(may_enter);
    if
    :: may_enter ->
      is_searching = true;
      do
      :: take_seat(); serve(); leave();
        if
        :: stays
        :: else -> break
        fi
      od
    :: else
    fi
  od
}

#ifdef END
active proctype Canceller() { cancelled = true }
#endif
