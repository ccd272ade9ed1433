"""The STM32H743's peripherals as far as the firmware uses them, one per file. Registers are those of RM0433."""
