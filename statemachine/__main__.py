from statemachine_sim import main

raise SystemExit(main())
