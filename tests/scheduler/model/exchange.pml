/* What waits outside the workers, for the model checker spin: stages with a cap, stages that block, and what has
 * been spilled to a file. protocol.pml has the rest; here every atomic operation is one step in one order, because
 * its question about store buffers is answered there.
 *
 * The graph: source -> plain -> capped -> blocking, and what the blocking stage makes of the first item is a plain or
 * a capped one again, which lands. README.md maps each inline to the function of scheduler/src that it mirrors.
 *
 * Parameters: ROOTS, CREDITS, CAP (calls of the capped stage at once), BLOCKERS (threads of the blocking stage).
 * Variants: SPILL (what is published may go to the file instead), END (the run may be ended at any moment).
 * Mistakes (MISTAKE_...): each must be found; see CMakeLists.txt.
 */
#ifndef ROOTS
#define ROOTS 2
#endif
#ifndef CREDITS
#define CREDITS 2
#endif
#ifndef CAP
#define CAP 1
#endif
#ifndef BLOCKERS
#define BLOCKERS 1
#endif
#define SEATS 2
mtype:work = { NOTHING, SOURCE, PLAIN, CAPPED, CALLER, HELPER };

/* Gate. */
byte present = 1, searching, invited, posted;
bool caller_asleep, closed, held, stopped;
bit signal;
bool seat_free[SEATS] = true;
byte landed;

/* OpenTable and ReadyQueue of each seat: blocks by kind. What is ready of a capped stage has a token. */
byte open_plain[SEATS], open_capped[SEATS], open_blocked[SEATS];
byte ready_plain[SEATS], ready_capped[SEATS];
#define ready(seat) (ready_plain[seat] + ready_capped[seat])

/* Exchange: lots by kind. */
bool abandoned, errand, holds;
byte lot_plain, lot_capped, lot_blocked, tokens, calls;

/* Spill: blocks in the file. BlockingCrew: calls that are out. Credits and the source. */
byte file, crew_calls, purse = CREDITS, born;

/* What only the checks know. */
byte retired, capped_running;
bool cycled, returned;

#define hungry() (searching == 0 && present + invited < SEATS && !closed)
#define source_ready() (born < ROOTS && purse > 0)
#ifdef MISTAKE_FILE_FORGOTTEN
#define wants_a_worker() source_ready()
#else
#define wants_a_worker() (source_ready() || file > 0)
#endif
#ifdef MISTAKE_LOT_NOT_TAKEABLE
#define takeable() (lot_plain > 0)
#else
#define takeable() ((lot_plain > 0) + (lot_capped > 0 && tokens < CAP))
#endif

/* ---- Gate ---- */

/* found: what leavers and searchers see; in one step, because protocol.pml takes it apart. */
inline any_ready() { found = ready(0) > 0 || ready(1) > 0 || landed > 0 }

inline invite() {
  atomic {
    if
    :: hungry() && caller_asleep -> invited++; caller_asleep = false; call = CALLER
    :: hungry() && !caller_asleep -> invited++; call = HELPER
    :: else
    fi
  }
  if
  :: call == CALLER -> atomic { signal = 1; call = NOTHING }
  :: call == HELPER -> atomic { posted++; call = NOTHING }
  :: else
  fi
}

inline invite_if_hungry() {
  if
  :: hungry() -> invite()
  :: else
  fi
}

inline enter(let_in) {
  atomic {
    if
    :: closed -> let_in = false
    :: else -> invited--; present++; searching++; let_in = true
    fi
  }
}

inline take_seat() {
  atomic {
    seat = (seat_free[0] -> 0 : 1);
    assert(seat_free[seat]);
    seat_free[seat] = false
  }
}

inline leave() {
  atomic {
    present--;
    searching--;
    if
    :: present == 0 && !held -> closed = true; closes = true
    :: else -> caller_asleep = caller_asleep || is_caller
    fi
  }
  stays = false;
  if
  :: closes -> signal = 1
  :: !closes && !stopped ->
    any_ready();
    if
    :: found -> come_back()
    :: else
    fi
  :: else
  fi;
  found = false
}

inline come_back() {
  atomic {
    if
    :: closed || (is_caller && !caller_asleep) || present + invited >= SEATS
    :: else -> present++; searching++; caller_asleep = caller_asleep && !is_caller; stays = true
    fi
  }
}

/* ---- Exchange: what is done under its mutex is one step ---- */

inline update() {
  landed = takeable() + errand;
#ifdef MISTAKE_HOLD_WITHOUT_CALLS
  wanted = !abandoned && (takeable() > 0 || errand || lot_blocked > 0);
#else
#ifdef MISTAKE_HOLD_WITHOUT_WAITING
  wanted = calls > 0 || (!abandoned && (takeable() > 0 || errand));
#else
  wanted = calls > 0 || (!abandoned && (takeable() > 0 || errand || lot_blocked > 0));
#endif
#endif
  if
  :: wanted && !holds -> held = true
  :: !wanted && holds ->           /* Gate::release_hold */
    held = false;
    if
    :: present == 0 -> closed = true; signal = 1
    :: else
    fi
  :: else
  fi;
  holds = wanted
}

/* hand: the block, if it got a token; otherwise it has stayed in the exchange. */
inline admit_capped() {
  atomic {
    if
    :: tokens < CAP -> tokens++; hand = CAPPED
#ifdef MISTAKE_NO_TOKEN
    :: tokens == CAP -> hand = CAPPED
#else
    :: tokens == CAP -> lot_capped++
#endif
    fi;
    update()
  }
}

inline admit_blocked() {
  atomic { lot_blocked++; update() }
  summon_blocking()
}

inline pass_on() {
  atomic {
    if
#ifndef MISTAKE_TOKEN_STAYS
    :: lot_capped > 0 && !abandoned -> lot_capped--; ready_capped[seat]++; passed = true
    :: else -> tokens--
#else
    :: true              /* nobody gets the token */
#endif
    fi;
    update()
  }
  if
  :: passed -> passed = false; invite_if_hungry()
  :: else
  fi
}

inline take_landed() {
  if
  :: landed > 0 ->
    atomic {
      if
      :: lot_capped > 0 && tokens < CAP -> lot_capped--; tokens++; hand = CAPPED
      :: !(lot_capped > 0 && tokens < CAP) && lot_plain > 0 -> lot_plain--; hand = PLAIN
      :: else
      fi;
      update()
    }
  :: else
  fi
}

inline take_errand() {
  if
  :: landed > 0 -> atomic { found = errand; errand = false; update() }
  :: else
  fi
}

inline abandon() { stopped = true; atomic { abandoned = true; update() } }

/* ---- BlockingCrew ---- */

inline summon_blocking() {
  atomic {
    if
    :: crew_calls < BLOCKERS -> crew_calls++
    :: else
    fi
  }
}

/* ---- Worker ---- */

inline publish_plain() {
  if
  :: ready_plain[seat]++; invite_if_hungry()
#ifdef SPILL
  :: file++
#endif
  fi
}

inline publish_capped() {
  admit_capped();
  if
  :: hand == CAPPED -> hand = NOTHING; ready_capped[seat]++; invite_if_hungry()
  :: else
  fi
}

inline take_own(plain, capped) {
  d_step {
    if
    :: capped > 0 -> capped--; hand = CAPPED
    :: capped == 0 && plain > 0 -> plain--; hand = PLAIN
    :: else
    fi
  }
}

inline take_spilled() {
  d_step {
    if
    :: file > 0 -> file--; hand = PLAIN
    :: else
    fi
  }
}

inline take_source() {
  atomic {
    if
    :: source_ready() -> purse--; born++; hand = SOURCE
    :: else
    fi
  }
}

inline take_open() {
  do
  :: hand == NOTHING && open_plain[seat] > 0 -> open_plain[seat]--; hand = PLAIN
  :: hand == NOTHING && open_capped[seat] > 0 -> open_capped[seat]--; admit_capped()
  :: hand == NOTHING && open_blocked[seat] > 0 -> open_blocked[seat]--; admit_blocked()
  :: hand != NOTHING || open_plain[seat] + open_capped[seat] + open_blocked[seat] == 0 -> break
  od
}

#define otherwise(step) if :: hand == NOTHING -> step :: else fi

inline acquire() {
  take_own(ready_plain[seat], ready_capped[seat]);
  otherwise(take_landed());
#ifdef SPILL
  otherwise(take_spilled());
#endif
  otherwise(take_own(ready_plain[1 - seat], ready_capped[1 - seat]));   /* steal */
  otherwise(take_open());
  otherwise(take_source())
}

inline perform() {
  assert(!returned);
  if
  :: hand == SOURCE -> open_plain[seat]++
  :: hand == PLAIN ->
    hand = NOTHING;
    if
    :: open_capped[seat]++
    :: publish_capped()            /* the block is full */
    fi
  :: hand == CAPPED ->
    hand = NOTHING;
    capped_running++;
    assert(capped_running <= CAP);
    if
    :: open_blocked[seat]++
    :: admit_blocked()
    fi;
    capped_running--;
    pass_on()
  fi;
  hand = NOTHING;
  if
  :: hungry() && open_plain[seat] > 0 -> open_plain[seat]--; publish_plain()     /* share */
  :: hungry() && (ready(seat) > 0 || wants_a_worker()) -> invite()
  :: skip
  fi
}

inline found_work() {
  is_searching = false;
  searching--;
  if
  :: hungry() ->
    any_ready();
    if
    :: found -> invite()
    :: else
    fi;
    found = false
  :: else
  fi
}

inline search() {
  found = false;
  take_errand();
  if
  :: !is_searching -> is_searching = true; searching++
  :: else
  fi;
  go_on = found || source_ready();
  if
  :: !go_on && !stopped && present > searching -> any_ready(); go_on = found || wants_a_worker()
  :: else
  fi;
  found = false
}

inline serve() {
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
    :: else ->
      search();
      if
      :: go_on
      :: else -> break
      fi
    fi
  od;
  if
  :: !is_searching -> searching++
  :: else
  fi;
  is_searching = true;
  seat_free[seat] = true
}

/* ---- Threads ---- */

#define LOCALS(caller)                                                                      \
  mtype:work hand = NOTHING, call = NOTHING;                                                \
  byte seat;                                                                                \
  bool is_searching, found, go_on, stays, closes, may_enter, wanted, passed;                \
  bool is_caller = caller

#define all_done() (born == ROOTS && retired == ROOTS && purse == CREDITS)

active proctype Caller() {
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
    assert(present == 0 && calls == 0);
    assert(stopped || (all_done() && tokens == 0))
  }
}

active proctype Helper() {
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

/* BlockingCrew::serve, BlockingWorker. */

inline land() {
  if
  :: atomic { lot_plain++; update() } invite_landed()
  :: atomic { lot_capped++; update() } invite_landed()
#ifdef SPILL
  :: file++
#endif
  fi
}

inline invite_landed() {
#ifndef MISTAKE_NOBODY_CALLED
  invite_if_hungry()
#else
  skip
#endif
}

active [BLOCKERS] proctype Blocker() {
  bool taken, found, wanted, errand_wanted;
  mtype:work call = NOTHING;
end:
  do
  ::
#ifdef MISTAKE_CALL_ANSWERED_LATE
    crew_calls > 0;
#else
    atomic { crew_calls > 0 -> crew_calls-- };
#endif
    do
    ::
      atomic {           /* take_waiting */
        taken = lot_blocked > 0 && !abandoned;
        if
        :: taken -> lot_blocked--; calls++; update()
        :: else
        fi
      }
      if
      :: !taken -> break
      :: else
      fi;
      assert(!returned);
      if                 /* perform */
      :: stopped
      :: !stopped && !cycled -> cycled = true; land()
      :: else -> atomic { retired++; purse = purse + 1 }
      fi;
#ifndef MISTAKE_NO_ERRAND
      errand_wanted = wants_a_worker();
#endif
      atomic { calls--; errand = errand || (errand_wanted && !abandoned); update() }    /* finish_call */
      any_ready();
      if
      :: found -> invite_landed()
      :: else
      fi;
      found = false
    od;
#ifdef MISTAKE_CALL_ANSWERED_LATE
    crew_calls--
#endif
  od
}

#ifdef END
active proctype Ender() {
  bool wanted;
  abandon()
}
#endif
